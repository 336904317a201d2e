//! What the command line names, and names that hold anywhere.

use std::path::{Path, PathBuf};

/// What the command line names.
#[derive(Clone, Copy)]
pub(super) struct Named<'a> {
    pub(super) scene: Option<&'a Path>,
    pub(super) gaussians: Option<&'a Path>,
    pub(super) capture: Option<&'a Path>,
    /// Seed of a new plan.
    pub(super) seed: Option<u64>,
    /// A plan to go on with.
    pub(super) plan: Option<&'a Path>,
    /// Folders of environment maps, and of what the plan may read.
    pub(super) assets: &'a [PathBuf],
    /// Whether a file of Gaussians that is not there yet is waited for.
    pub(super) wait: bool,
    /// Whether prepared views are kept.
    pub(super) cache: bool,
}

/// A path that means the same from any folder.
pub(super) fn absolute(path: &Path) -> String {
    let full = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    full.to_string_lossy().into_owned()
}
