//! What is said about a file or folder.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::Serialize;
use serde_json::Value;

/// What something is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Gaussians in any format.
    Gaussians,
    /// Points with colors.
    Points,
    /// Triangles.
    Mesh,
    /// A glTF without Gaussians.
    Model,
    /// A picture of 8 or 16 bits.
    Picture,
    /// OpenEXR: named channels.
    Channels,
    /// A folder of pictures.
    Pictures,
    /// A capture.
    Capture,
    /// A folder made by decompose, relight or edit.
    Scene,
    /// A selection of Gaussians.
    Selection,
    /// A plan of edits, or the log of a run.
    EditPlan,
    /// A path of cameras.
    CameraPath,
    /// A fit in progress.
    Checkpoint,
    /// Named arrays that are no checkpoint.
    Tensors,
    /// How a product was made.
    RunRecord,
    /// Scores.
    Metrics,
    /// Another JSON document of motes.
    Document,
    /// A reconstruction of COLMAP.
    ColmapModel,
    /// `transforms.json`.
    Transforms,
    /// Nothing that motes reads.
    #[default]
    Unknown,
}

impl Kind {
    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gaussians => "Gaussians",
            Self::Points => "points",
            Self::Mesh => "mesh",
            Self::Model => "glTF model",
            Self::Picture => "picture",
            Self::Channels => "image of named channels",
            Self::Pictures => "folder of pictures",
            Self::Capture => "capture",
            Self::Scene => "scene folder",
            Self::Selection => "selection",
            Self::EditPlan => "edit plan",
            Self::CameraPath => "camera path",
            Self::Checkpoint => "checkpoint of train-splat",
            Self::Tensors => "tensors",
            Self::RunRecord => "run record",
            Self::Metrics => "metrics",
            Self::Document => "document of motes",
            Self::ColmapModel => "COLMAP model",
            Self::Transforms => "posed photos",
            Self::Unknown => "nothing that motes reads",
        }
    }
}

/// An axis-aligned box in the axes of the file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: [f32; 3],
    /// Largest coordinates.
    pub max: [f32; 3],
}

/// What a file or folder is and holds. Keys that do not apply are absent from the JSON.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Description {
    /// As given.
    pub path: PathBuf,
    /// What it is.
    pub kind: Kind,
    /// Layout of the file: `ply`, `spz`, `motes/capture 1.1`.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub format: String,
    /// Size of the file; of a folder, of the files that were read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
    /// How many of what: `gaussians`, `views`, `triangles`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub counts: BTreeMap<String, u64>,
    /// Degree of the spherical harmonics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sh_degree: Option<u8>,
    /// Width and height.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_px: Option<[usize; 2]>,
    /// Box around the positions: means, points, vertices, or centers of cameras.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounds: Option<Bounds>,
    /// Columns of a table, channels of an image, names of tensors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub columns: Vec<String>,
    /// Values that are NaN or infinite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub non_finite: Option<u64>,
    /// Program and version.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub made_by: Option<String>,
    /// Seed of the random numbers it was made with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// What only this kind has, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub facts: BTreeMap<String, Value>,
    /// What a reader should know.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

impl Description {
    /// Of a kind and layout.
    pub fn new(kind: Kind, format: impl Into<String>) -> Self {
        Self { kind, format: format.into(), ..Self::default() }
    }

    /// Adds a count.
    #[must_use]
    pub fn count(mut self, what: &str, n: usize) -> Self {
        self.counts.insert(what.to_owned(), n as u64);
        self
    }

    /// Adds what only this kind has; nothing for null.
    #[must_use]
    pub fn fact(mut self, name: &str, value: impl Into<Value>) -> Self {
        let value = value.into();
        if !value.is_null() {
            self.facts.insert(name.to_owned(), value);
        }
        self
    }

    /// Label and text of every line below the first.
    fn lines(&self) -> Vec<(String, String)> {
        let mut lines: Vec<(String, String)> = Vec::new();
        let label = |name: &str| name.replace("_db", "_dB").replace('_', " ");
        let mut line = |name: &str, text: String| lines.push((label(name), text));
        for (what, n) in &self.counts {
            line(what, grouped(*n));
        }
        if let Some(degree) = self.sh_degree {
            line("SH degree", degree.to_string());
        }
        if let Some([width, height]) = self.size_px {
            line("pixels", format!("{width} x {height}"));
        }
        if let Some(Bounds { min, max }) = self.bounds {
            // Minus zero is zero to a reader.
            let (min, max) = (min.map(|v| v + 0.0), max.map(|v| v + 0.0));
            let axis = |i: usize| format!("{} {} to {}", ["x", "y", "z"][i], min[i], max[i]);
            line("bounds", [0, 1, 2].map(axis).join(", "));
        }
        if !self.columns.is_empty() {
            line("columns", numbered_runs(&self.columns).join(", "));
        }
        match self.non_finite {
            Some(0) => line("non-finite", "none".into()),
            Some(n) => line("non-finite", format!("{} values are NaN or infinite", grouped(n))),
            None => {}
        }
        for (name, value) in &self.facts {
            line(name, value_text(value));
        }
        if let Some(program) = &self.made_by {
            line("made by", program.clone());
        }
        if let Some(seed) = self.seed {
            line("seed", seed.to_string());
        }
        for warning in &self.warnings {
            line("warning", warning.clone());
        }
        lines
    }
}

impl fmt::Display for Description {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.path.display())?;
        let mut first = vec![self.kind.name().to_owned()];
        first.extend(Some(self.format.clone()).filter(|format| !format.is_empty()));
        first.extend(self.bytes.map(bytes_text));
        writeln!(f, "  {}", first.join(", "))?;
        let lines = self.lines();
        let width = lines.iter().map(|(label, _)| label.len()).max().unwrap_or_default();
        lines.iter().try_for_each(|(label, text)| writeln!(f, "  {label:width$}  {text}"))
    }
}

fn value_text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) => items.iter().map(value_text).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

/// Digits in groups of three.
fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let first = (digits.len() + 2) % 3 + 1;
    let (head, rest) = digits.split_at(first.min(digits.len()));
    let rest = rest.as_bytes().chunks(3).map(|group| String::from_utf8_lossy(group).into_owned());
    std::iter::once(head.to_owned()).chain(rest).collect::<Vec<_>>().join(",")
}

fn bytes_text(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{} bytes", grouped(bytes)),
        10_000..10_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

/// `a_0, a_1, a_2, a_3` as `a_0 ... a_3`.
fn numbered_runs(names: &[String]) -> Vec<String> {
    let parts = |name: &str| {
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        Some((stem.to_owned(), name[stem.len()..].parse::<u64>().ok()?))
    };
    let mut runs: Vec<Vec<&String>> = Vec::new();
    for name in names {
        let follows = |last: &&String| match (parts(last), parts(name)) {
            (Some((a, i)), Some((b, j))) => a == b && j == i + 1,
            _ => false,
        };
        match runs.last_mut() {
            Some(run) if run.last().is_some_and(follows) => run.push(name),
            _ => runs.push(vec![name]),
        }
    }
    let text = |run: Vec<&String>| match run.as_slice() {
        [first, _, _, .., last] => vec![format!("{first} ... {last}")],
        few => few.iter().map(|name| (*name).clone()).collect(),
    };
    runs.into_iter().flat_map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped_and_runs_are_short() {
        for (n, text) in [(0, "0"), (12, "12"), (123, "123"), (1234, "1,234")] {
            assert_eq!(grouped(n), text);
        }
        assert_eq!(grouped(1_234_567), "1,234,567");
        let names = ["x", "f_0", "f_1", "f_2", "f_3", "r_0", "r_1"].map(str::to_owned);
        assert_eq!(numbered_runs(&names), ["x", "f_0 ... f_3", "r_0", "r_1"]);
    }

    #[test]
    fn what_is_not_known_is_not_said() {
        let json = serde_json::to_value(Description::new(Kind::Unknown, "")).unwrap();
        assert_eq!(json, serde_json::json!({ "path": "", "kind": "unknown" }));
        let text = Description::new(Kind::Points, "ply").count("points", 3).to_string();
        assert_eq!(text, "\n  points, ply\n  points  3\n");
    }
}
