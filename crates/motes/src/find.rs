//! Where the programs of stages lie.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

/// Folders in the order in which they are searched.
pub(crate) struct Finder {
    /// Hold stages under their plain names.
    pub(crate) folders: Vec<PathBuf>,
    /// Hold stages as `motes-STAGE`.
    pub(crate) path: Vec<PathBuf>,
}

impl Finder {
    pub(crate) fn from_environment() -> Self {
        let split = |variable| {
            std::env::var_os(variable)
                .map(|value| std::env::split_paths(&value).collect::<Vec<_>>())
                .unwrap_or_default()
        };
        let mut folders = split("MOTES_STAGE_PATH");
        // A link in ~/bin stands for the program it points to.
        let here = std::env::current_exe().and_then(|exe| exe.canonicalize());
        if let Some(here) = here.ok().as_deref().and_then(Path::parent) {
            folders.push(here.to_owned());
            folders.push(here.join("../libexec/motes"));
        }
        folders.retain(|folder| !folder.as_os_str().is_empty());
        Self { folders, path: split("PATH") }
    }

    /// The program of a stage. Names with a separator are not stages: `motes ../x` must not run.
    pub(crate) fn find(&self, stage: &str) -> Option<PathBuf> {
        let plain = !stage.is_empty()
            && !stage.starts_with('-')
            && stage != "motes"
            && stage.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
        if !plain {
            return None;
        }
        let named = self.folders.iter().map(|folder| folder.join(file_name("", stage)));
        let prefixed = self.path.iter().map(|folder| folder.join(file_name("motes-", stage)));
        named.chain(prefixed).find(|candidate| is_program(candidate))
    }
}

pub(crate) fn is_program(path: &Path) -> bool {
    let Ok(meta) = std::fs::metadata(path) else { return false };
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        meta.is_file() && meta.permissions().mode() & 0o111 != 0
    }
    #[cfg(not(unix))]
    meta.is_file()
}

/// The name of a stage as a file on this system.
fn file_name(prefix: &str, stage: &str) -> OsString {
    let mut name = OsString::from(format!("{prefix}{stage}"));
    name.push(OsStr::new(std::env::consts::EXE_SUFFIX));
    name
}
