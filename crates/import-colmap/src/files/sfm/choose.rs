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
    /// Whether photos that are placed against what their matches say are left out.
    pub(super) fn checks_matches(&self) -> bool {
        matches!(self, Self::Pycolmap { .. })
    }

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
            tracing::info!("structure from motion runs in {}", python.display());
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

/// A Python with pycolmap, unless the options ask for another program.
pub(super) fn python_with_pycolmap(options: &SfmOptions) -> Option<PathBuf> {
    let tried = pythons(options.python.as_deref());
    let allowed = options.sfm != SfmTool::Colmap;
    tried.into_iter().filter(|_| allowed).find(|python| has_pycolmap(python))
}

/// Interpreters to try, in order. Never one of the current folder or above it: photos come in archives of other people.
fn pythons(given: Option<&Path>) -> Vec<PathBuf> {
    if let Some(python) = given {
        return vec![python.to_path_buf()];
    }
    let program = std::env::current_exe().ok();
    let mut found: Vec<PathBuf> = Vec::new();
    for folder in program.iter().flat_map(|program| places(program)) {
        for name in [".venv/bin/python", ".venv/Scripts/python.exe"] {
            let python = folder.join(name);
            if !python.is_file() {
                continue;
            }
            if trusted(&folder, &python) {
                found.push(python);
            } else {
                tracing::warn!("not started, it belongs to another user: {}", python.display());
            }
        }
    }
    found.extend(on_path("python3"));
    found
}

/// The folder of a program, and the checkout when it lies in `target/PROFILE` of one.
fn places(program: &Path) -> Vec<PathBuf> {
    let Some(folder) = program.parent() else { return Vec::new() };
    let target = folder.parent().filter(|above| above.ends_with("target"));
    let checkout = target.and_then(Path::parent);
    [Some(folder), checkout].into_iter().flatten().map(Path::to_path_buf).collect()
}

/// A program of `PATH`; entries that depend on the current folder do not count.
fn on_path(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders)
        .filter(|folder| folder.is_absolute())
        .map(|folder| folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX)))
        .find(|program| program.is_file())
}

/// Whether nobody but this user and root can have put the interpreter there.
#[cfg(unix)]
fn trusted(folder: &Path, python: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let user = nix::unistd::geteuid().as_raw();
    let below = python.ancestors().take_while(|path| *path != folder);
    below.into_iter().all(|path| {
        std::fs::symlink_metadata(path).is_ok_and(|found| {
            let is_ours = found.uid() == user || found.uid() == 0;
            // A link has no rights of its own.
            is_ours && (found.is_symlink() || found.mode() & 0o002 == 0)
        })
    })
}

#[cfg(not(unix))]
fn trusted(_folder: &Path, _python: &Path) -> bool {
    true
}

fn has_pycolmap(python: &Path) -> bool {
    // Finding the package is enough and quick; importing it loads a hundred megabytes. The current folder, which is an
    // empty entry, must not stand in for the standard library.
    let test = "import sys; sys.path[:] = [p for p in sys.path if p]; \
                import importlib.util as u; sys.exit(u.find_spec('pycolmap') is None)";
    Command::new(python)
        .args(["-c", test])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpreters_lie_beside_the_program_or_in_its_checkout() {
        let places = |program: &str| places(Path::new(program));
        assert_eq!(places("/usr/lib/motes/x"), [Path::new("/usr/lib/motes")]);
        let checkout = ["/src/motes/target/release", "/src/motes"].map(PathBuf::from);
        assert_eq!(places("/src/motes/target/release/x"), checkout);
    }

    #[cfg(unix)]
    #[test]
    fn an_interpreter_that_others_can_replace_is_not_trusted() {
        use std::os::unix::fs::PermissionsExt as _;
        let dir = tempfile::tempdir().unwrap();
        let bin = dir.path().join(".venv/bin");
        std::fs::create_dir_all(&bin).unwrap();
        let python = bin.join("python");
        std::fs::write(&python, "").unwrap();
        let open_to = |mode| {
            std::fs::set_permissions(&bin, std::fs::Permissions::from_mode(mode)).unwrap();
            trusted(dir.path(), &python)
        };
        assert!(open_to(0o755) && !open_to(0o777));
    }
}
