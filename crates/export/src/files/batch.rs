//! Many files of Gaussians, each in the same format into one folder: `export *.ply --format spz -o out/`.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use motes_codecs::SplatFormat;
use motes_stage::{Context, StageError};
use serde::Serialize;

use super::ExportReport;

/// The report about a batch.
#[derive(Clone, Debug, Serialize)]
pub struct BatchReport {
    /// Where the files are.
    pub output: PathBuf,
    /// The files, in the order of the inputs.
    pub files: Vec<ExportReport>,
}

impl fmt::Display for BatchReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for file in &self.files {
            writeln!(f, "{file}")?;
        }
        write!(f, "{} files in {}", self.files.len(), self.output.display())
    }
}

/// Whether an output is a folder of files: one that is there, or whose name ends in a slash.
pub(super) fn is_folder(output: &Path) -> bool {
    let name = output.as_os_str().to_string_lossy();
    output.is_dir() || name.ends_with(std::path::is_separator)
}

/// The file that each input becomes, claimed: the input's name with the first suffix of the format.
///
/// # Errors
/// When two inputs become one file, or one is there already.
pub(super) fn claim(
    inputs: &[PathBuf],
    folder: &Path,
    format: SplatFormat,
    context: &Context,
) -> anyhow::Result<Vec<PathBuf>> {
    let suffix = format.codec().suffixes.first().copied().unwrap_or_default();
    let mut sources: BTreeMap<PathBuf, &PathBuf> = BTreeMap::new();
    for input in inputs {
        let output = folder.join(format!("{}{suffix}", stem(input)));
        if let Some(other) = sources.insert(output.clone(), input) {
            let text = format!(
                "{} and {} would both become {}",
                other.display(),
                input.display(),
                output.display()
            );
            return Err(StageError::usage(text).help("rename one, or export it by itself").into());
        }
    }
    let output = |input: &PathBuf| context.output(folder.join(format!("{}{suffix}", stem(input))));
    inputs.iter().map(output).collect()
}

/// The name of a file without the suffix of its format.
fn stem(input: &Path) -> String {
    let name = input.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let lower = name.to_lowercase();
    let suffixes = SplatFormat::ALL.iter().flat_map(|format| format.codec().suffixes);
    let fitting = suffixes.filter(|suffix| lower.ends_with(**suffix)).map(|suffix| suffix.len());
    match fitting.max().filter(|length| *length < name.len()) {
        Some(length) => name[..name.len() - length].to_owned(),
        None => name.rsplit_once('.').map_or(name.clone(), |(stem, _)| stem.to_owned()),
    }
}

/// Exports file after file. One that cannot be read or written does not end the others.
///
/// # Errors
/// When any failed, after all were tried; the user's interruption at once.
pub(super) fn export_all(
    inputs: &[PathBuf],
    outputs: Vec<PathBuf>,
    folder: &Path,
    context: &Context,
    export: impl Fn(&Path, PathBuf) -> anyhow::Result<ExportReport>,
) -> anyhow::Result<BatchReport> {
    let progress = context.progress("exporting", inputs.len() as u64);
    let (mut files, mut failed) = (Vec::new(), Vec::new());
    for (i, (input, output)) in inputs.iter().zip(outputs).enumerate() {
        context.check_interrupted()?;
        match export(input, output) {
            Ok(report) => files.push(report),
            Err(error) => {
                context.warn(format!("{error:#}"));
                failed.push(input.display().to_string());
            }
        }
        progress.set(i as u64 + 1);
    }
    if failed.is_empty() {
        return Ok(BatchReport { output: folder.to_owned(), files });
    }
    let named = failed.iter().take(5).cloned().collect::<Vec<_>>().join(", ");
    let more = if failed.len() > 5 { ", ..." } else { "" };
    let text =
        format!("{} of {} files were not exported: {named}{more}", failed.len(), inputs.len());
    let help = format!("the warnings say why; the others are in {}", folder.display());
    Err(StageError::bad_input(text).help(help).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stem_is_the_name_without_the_suffix_of_its_format() {
        for (name, expected) in [
            ("a/g.ply", "g"),
            ("g.v2.spz", "g.v2"),
            ("G.COMPRESSED.PLY", "G"),
            ("noise", "noise"),
            (".ply", ""),
        ] {
            assert_eq!(stem(Path::new(name)), expected, "{name}");
        }
    }
}
