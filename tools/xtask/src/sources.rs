//! The text files of the repository.

use std::path::Path;
use std::process::Command;

use anyhow::bail;

/// A text file of the repository.
#[derive(Debug)]
pub(crate) struct Source {
    /// Path from the root, with `/`.
    pub(crate) path: String,
    pub(crate) text: String,
}

/// All text files that git knows or would add.
pub(crate) fn sources(root: &Path) -> anyhow::Result<Vec<Source>> {
    let listing = ["ls-files", "-z", "--cached", "--others", "--exclude-standard"];
    let output = Command::new("git").current_dir(root).args(listing).output()?;
    if !output.status.success() {
        bail!("git ls-files failed: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    let names = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut paths: Vec<&str> = names.split('\0').filter(|path| !path.is_empty()).collect();
    paths.sort_unstable();
    paths.dedup();
    let read = |path: &&str| {
        // Pictures and deliberately broken files are not text; a deleted one is not there.
        let text = std::fs::read_to_string(root.join(path)).ok().filter(|t| !t.contains('\0'))?;
        Some(Source { path: (*path).to_owned(), text })
    };
    Ok(paths.iter().filter_map(read).collect())
}
