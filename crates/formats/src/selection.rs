//! `selection.json`: which Gaussians of one file are meant.
//!
//! Rows of a file mean nothing in another one, so a selection names the SHA-256 of the file that it was
//! made on and reading compares it: a stale selection is an error, never a wrong edit.

use std::fmt;
use std::io::Read;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use motes_scene::Selection;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::documents::{Document, Parsed, read_document, write_document};
use crate::error::{FormatError, Result};
use crate::selectors::SelectStep;

/// Steps of a stored confidence from 0 to 1: 8 bits, of which the upper half belongs.
const STEPS: f32 = 255.0;

/// A set of the Gaussians of one file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes selection")]
pub struct SelectionDocument {
    /// `motes/selection`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Program and version that made it.
    #[serde(default)]
    pub made_by: String,
    /// The Gaussians that were selected from.
    pub gaussians: BoundGaussians,
    /// Number of Gaussians that belong.
    pub count: u64,
    /// One bit per Gaussian, the first one in the lowest bit of the first byte; base64.
    pub bits: String,
    /// One byte per Gaussian, probability of belonging times 255; base64. It belongs from 128 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confidence: Option<String>,
    /// Bounds of what was selected, world.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object_box: Option<BoxDocument>,
    /// What it stands on, where something was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub support_plane: Option<PlaneDocument>,
    /// How it was made; only for people and for making it again.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<SelectStep>,
}

impl Document for SelectionDocument {
    const FORMAT: &'static str = "motes/selection";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 0;
}

/// A file of Gaussians, by what is in it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct BoundGaussians {
    /// SHA-256 of the file, hexadecimal.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub sha256: String,
    /// Number of Gaussians.
    pub count: u64,
    /// Name of the file, for messages.
    #[serde(default)]
    pub name: String,
    /// SHA-256 of another file with the same rows in the same order, whose selections are as good: what a scene folder was
    /// decomposed from. Not written.
    #[serde(skip)]
    pub same_rows_as: Option<String>,
}

impl BoundGaussians {
    /// The file at `path`, of which `count` Gaussians were read.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn of_file(path: &Path, count: usize) -> Result<Self> {
        Ok(Self::new(path, sha256_of_file(path)?, count))
    }

    /// Of a file whose hex SHA-256 is known.
    pub fn new(path: &Path, sha256: String, count: usize) -> Self {
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        Self { sha256, count: count as u64, name, same_rows_as: None }
    }
}

/// An axis-aligned box, world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BoxDocument {
    /// Smallest coordinates.
    pub min: [f64; 3],
    /// Largest coordinates.
    pub max: [f64; 3],
}

/// The plane `normal . x = offset`, world; the normal points away from the matter below.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlaneDocument {
    /// Unit normal.
    pub normal: [f64; 3],
    /// Distance from the origin along the normal, world units.
    pub offset: f64,
}

/// What a selection says besides which Gaussians belong.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SelectionNotes {
    /// Bounds of what was selected.
    pub object_box: Option<BoxDocument>,
    /// What it stands on.
    pub support_plane: Option<PlaneDocument>,
    /// How it was made.
    pub steps: Vec<SelectStep>,
}

/// A selection that was read and belongs to the Gaussians at hand.
#[derive(Clone, Debug, PartialEq)]
pub struct SelectionFile {
    /// One confidence per Gaussian; 0 or 1 where the file holds none.
    pub selection: Selection,
    /// What else the file says.
    pub notes: SelectionNotes,
    /// Sentences about keys that were ignored.
    pub warnings: Vec<String>,
}

/// Hexadecimal SHA-256 of a file.
///
/// # Errors
/// The file cannot be read.
pub fn sha256_of_file(path: &Path) -> Result<String> {
    let io = |error| FormatError::io(path, error);
    let mut file = std::fs::File::open(path).map_err(io)?;
    let (mut hasher, mut buffer) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer).map_err(io)? {
            0 => break,
            count => hasher.update(&buffer[..count]),
        }
    }
    Ok(hex(&hasher.finalize()))
}

/// Hexadecimal SHA-256 of bytes.
pub fn sha256_of_bytes(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl SelectionDocument {
    /// A document of `selection`, which belongs to `gaussians`. The bits decide who belongs; the
    /// confidence is rounded to 8 bits on the same side of one half.
    ///
    /// # Panics
    /// When the number of Gaussians differs from that of `gaussians`.
    pub fn new(selection: &Selection, gaussians: BoundGaussians, notes: SelectionNotes) -> Self {
        assert_eq!(selection.len() as u64, gaussians.count, "one confidence per Gaussian");
        let mut bits = vec![0u8; selection.len().div_ceil(8)];
        for row in selection.rows() {
            bits[row as usize / 8] |= 1 << (row % 8);
        }
        let byte = |(i, &c): (usize, &f32)| match selection.contains(i) {
            true => (c.min(1.0) * STEPS).round().max(128.0) as u8,
            false => (c.max(0.0) * STEPS).round().min(127.0) as u8,
        };
        let bytes: Vec<u8> = selection.confidence.iter().enumerate().map(byte).collect();
        let certain = bytes.iter().all(|&b| b == 0 || b == 255);
        Self {
            format: Self::FORMAT.into(),
            version: Self::version(),
            made_by: String::new(),
            gaussians,
            count: selection.count() as u64,
            bits: STANDARD.encode(&bits),
            confidence: (!certain).then(|| STANDARD.encode(&bytes)),
            object_box: notes.object_box,
            support_plane: notes.support_plane,
            steps: notes.steps,
        }
    }

    /// Checks the document against the Gaussians at hand; `path` names it in errors.
    ///
    /// # Errors
    /// As [`read_selection`].
    pub fn check(self, path: &Path, gaussians: &BoundGaussians) -> Result<SelectionFile> {
        let bound = &self.gaussians;
        let is_of = [Some(&gaussians.sha256), gaussians.same_rows_as.as_ref()];
        if !is_of.contains(&Some(&bound.sha256)) || bound.count != gaussians.count {
            let cause = format!(
                "a stale selection: it was made on {}, not on {}",
                Said(bound),
                Said(gaussians)
            );
            let remedy = "select again on these Gaussians with segment-select";
            return Err(FormatError::invalid(path, "/gaussians/sha256", cause).with_remedy(remedy));
        }
        let n = gaussians.count as usize;
        let bits = decoded(path, "/bits", &self.bits, n.div_ceil(8))?;
        let belongs = |i: usize| bits[i / 8] >> (i % 8) & 1 == 1;
        let selection = match &self.confidence {
            None => Selection::where_true(n, belongs),
            Some(text) => {
                let bytes = decoded(path, "/confidence", text, n)?;
                if let Some(i) = (0..n).find(|&i| belongs(i) != (bytes[i] >= 128)) {
                    let cause = format!("it disagrees with \"bits\" about Gaussian {i}");
                    return Err(FormatError::invalid(path, "/confidence", cause));
                }
                Selection { confidence: bytes.iter().map(|&b| f32::from(b) / STEPS).collect() }
            }
        };
        if bits.last().is_some_and(|last| !n.is_multiple_of(8) && last >> (n % 8) != 0) {
            let cause = format!("it has bits beyond the last of {n} Gaussians");
            return Err(FormatError::invalid(path, "/bits", cause));
        }
        if selection.count() as u64 != self.count {
            let cause = format!("{} Gaussians belong, not {}", selection.count(), self.count);
            return Err(FormatError::invalid(path, "/count", cause));
        }
        let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
        let plane_ok = self.support_plane.is_none_or(|p| {
            let length = p.normal.iter().map(|v| v * v).sum::<f64>().sqrt();
            (length - 1.0).abs() <= 1e-2 && p.offset.is_finite()
        });
        if !plane_ok || !self.object_box.is_none_or(|b| finite(&b.min) && finite(&b.max)) {
            let place = if plane_ok { "/object_box" } else { "/support_plane" };
            let cause = "its numbers are not finite or its normal is not a unit vector";
            return Err(FormatError::invalid(path, place, cause));
        }
        let notes = SelectionNotes {
            object_box: self.object_box,
            support_plane: self.support_plane,
            steps: self.steps,
        };
        Ok(SelectionFile { selection, notes, warnings: Vec::new() })
    }
}

/// How an error calls a file of Gaussians.
struct Said<'a>(&'a BoundGaussians);

impl fmt::Display for Said<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let BoundGaussians { sha256, count, name, .. } = self.0;
        let short: String = sha256.chars().take(12).collect();
        let name = if name.is_empty() { "a file" } else { name };
        write!(f, "{name} ({count} Gaussians, SHA-256 {short}...)")
    }
}

fn decoded(path: &Path, place: &str, text: &str, length: usize) -> Result<Vec<u8>> {
    let bytes = STANDARD.decode(text).map_err(|error| {
        FormatError::invalid(path, place, format!("this is not base64: {error}"))
    })?;
    if bytes.len() != length {
        let cause = format!("{} bytes where {length} are needed", bytes.len());
        return Err(FormatError::invalid(path, place, cause));
    }
    Ok(bytes)
}

/// Reads a selection of the Gaussians at hand.
///
/// # Errors
/// The document cannot be read or is malformed; it was made on other Gaussians (another hash or
/// count); its parts contradict each other.
pub fn read_selection(path: &Path, gaussians: &BoundGaussians) -> Result<SelectionFile> {
    let Parsed { document, warnings } = read_document::<SelectionDocument>(path)?;
    Ok(SelectionFile { warnings, ..document.check(path, gaussians)? })
}

/// Writes a selection.
///
/// # Errors
/// Writing fails.
pub fn write_selection(path: &Path, document: &SelectionDocument) -> Result<()> {
    write_document(path, document)
}

#[cfg(test)]
mod tests;
