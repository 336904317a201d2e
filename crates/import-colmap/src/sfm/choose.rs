//! Finding a program that can solve for poses.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::options::{SfmOptions, SfmTool};
use super::{Request, Solution, colmap_command, colmap_step, pycolmap};
use crate::error::{IngestError, Result};
use crate::progress::Progress;

/// A program that was found to work.
pub(super) enum Tool {
    Pycolmap { python: PathBuf },
    Colmap { command: PathBuf, version: String },
}

impl Tool {
    pub(super) fn solve(&self, request: &Request<'_>, progress: &dyn Progress) -> Result<Solution> {
        match self {
            Self::Pycolmap { python } => pycolmap::solve(python, request, progress),
            Self::Colmap { command, version } => {
                colmap_command::solve(command, version, request, progress)
            }
        }
    }
}

const SET_UP: &str = "set pycolmap up with: python3 -m venv .venv && .venv/bin/pip install -r \
    requirements.txt; or install the colmap command (Debian: apt-get install colmap)";

/// The tool that the options ask for.
pub(super) fn tool(options: &SfmOptions) -> Result<Tool> {
    let failed = |cause: String| IngestError::Failed { cause, remedy: SET_UP.into() };
    if options.sfm != SfmTool::Colmap {
        let tried = pythons(options.python.as_deref());
        if let Some(python) = tried.iter().find(|python| has_pycolmap(python)) {
            return Ok(Tool::Pycolmap { python: python.clone() });
        }
        if options.sfm == SfmTool::Pycolmap || options.python.is_some() {
            let tried: Vec<String> = tried.iter().map(|p| p.display().to_string()).collect();
            return Err(failed(format!(
                "no Python with pycolmap was found (tried {})",
                tried.join(", ")
            )));
        }
    }
    let command = PathBuf::from("colmap");
    match colmap_step::version_of(&command) {
        Some(version) => Ok(Tool::Colmap { command, version }),
        None if options.sfm == SfmTool::Colmap => {
            Err(failed("there is no colmap command on PATH".into()))
        }
        None => Err(failed("neither a Python with pycolmap nor a colmap command was found".into())),
    }
}

/// Interpreters to try, in order.
fn pythons(given: Option<&Path>) -> Vec<PathBuf> {
    if let Some(python) = given {
        return vec![python.to_path_buf()];
    }
    let starts = [std::env::current_dir().ok(), std::env::current_exe().ok()];
    let mut found: Vec<PathBuf> = Vec::new();
    for start in starts.into_iter().flatten() {
        for folder in start.ancestors() {
            for name in [".venv/bin/python", ".venv/Scripts/python.exe"] {
                let python = folder.join(name);
                if python.is_file() && !found.contains(&python) {
                    found.push(python);
                }
            }
        }
    }
    found.push("python3".into());
    found
}

fn has_pycolmap(python: &Path) -> bool {
    // Finding the package is enough and quick; importing it loads a hundred megabytes.
    let test = "import importlib.util as u, sys; sys.exit(u.find_spec('pycolmap') is None)";
    Command::new(python)
        .args(["-c", test])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}
