//! One run of a subcommand of `colmap`, with the options that the installed version knows.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::error::{IngestError, Result};
use crate::files::process::{Ended, Line, run};
use crate::progress::Progress;

/// `COLMAP 3.8`, when the command runs.
pub(super) fn version_of(command: &Path) -> Option<String> {
    let text = help(command, &["help"])?;
    let line = text.lines().find(|line| line.starts_with("COLMAP "))?;
    Some(line.split(" --").next()?.split(" (").next()?.trim().to_string())
}

fn help(command: &Path, arguments: &[&str]) -> Option<String> {
    let output = colmap(command).args(arguments).stdin(Stdio::null()).output().ok()?;
    let mut text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.push_str(&String::from_utf8_lossy(&output.stderr));
    Some(text)
}

fn colmap(command: &Path) -> Command {
    let mut colmap = Command::new(command);
    // Debian's build opens a window system even for commands without windows.
    colmap.env("QT_QPA_PLATFORM", "offscreen");
    // What it would log to a file is on standard error, too.
    colmap.env("GLOG_logtostderr", "1");
    colmap
}

/// One COLMAP subcommand with the options that this version of it knows.
pub(super) struct Step<'a> {
    command: &'a Path,
    name: &'a str,
    known: String,
    arguments: Vec<String>,
}

impl<'a> Step<'a> {
    pub(super) fn new(command: &'a Path, name: &'a str) -> Self {
        let known = help(command, &[name, "--help"]).unwrap_or_default();
        Self { command, name, known, arguments: Vec::new() }
    }

    /// Sets the first of `names` that this version has; none is not an error.
    pub(super) fn set(&mut self, names: &[&str], value: impl ToString) {
        let has = |name: &&&str| {
            self.known.split_whitespace().any(|word| word.strip_prefix("--") == Some(**name))
        };
        if let Some(name) = names.iter().find(has) {
            self.arguments.push(format!("--{name}"));
            self.arguments.push(value.to_string());
        }
    }

    pub(super) fn run(
        &self,
        progress: &dyn Progress,
        count: &mut dyn FnMut(&str),
    ) -> Result<Ended> {
        let mut command = colmap(self.command);
        command.arg(self.name).args(&self.arguments);
        let mut complaint = None;
        let ended = run(&mut command, progress, &mut |line| {
            let (Line::Out(text) | Line::Err(text)) = line;
            if text.contains("ERROR") || text.contains("Check failed") {
                complaint = Some(text.clone());
            }
            count(text);
        })?;
        if ended.status.success() {
            return Ok(ended);
        }
        let said = complaint.or_else(|| ended.last_words.last().cloned()).unwrap_or_default();
        Err(IngestError::Failed {
            cause: format!("colmap {} failed ({}): {said}", self.name, ended.status),
            remedy: "run again with -v to see its log, or use --sfm pycolmap".into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_known_options_are_passed() {
        let mut step = Step {
            command: Path::new("colmap"),
            name: "x",
            known: "  --SiftExtraction.use_gpu arg (=1)\n --image_path arg".into(),
            arguments: Vec::new(),
        };
        step.set(&["FeatureExtraction.use_gpu", "SiftExtraction.use_gpu"], 0);
        step.set(&["no_such"], 1);
        assert_eq!(step.arguments, ["--SiftExtraction.use_gpu", "0"]);
    }
}
