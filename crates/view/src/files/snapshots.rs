//! A file of Gaussians that grows while somebody looks at it: a training run writes `NAME.step-000500.ply` beside the
//! `NAME.ply` that it ends with. Its checkpoint, `NAME.checkpoint.safetensors`, stands for the run.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// What stands between the name of a product and the step of a snapshot.
const STEP: &str = ".step-";
/// What stands after the name of a product in that of the checkpoint of its run.
const CHECKPOINT: &str = ".checkpoint.safetensors";

/// A file, as it was when it was looked at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Version {
    /// Where it is.
    pub(super) path: PathBuf,
    modified: SystemTime,
    bytes: u64,
}

/// Whether a file is the checkpoint of a run, which holds no model that can be shown: it has the lengths of the fit.
pub(super) fn is_checkpoint(path: &Path) -> bool {
    path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.ends_with(CHECKPOINT))
}

/// The newest of a product and its snapshots, found by the name of any of them or of the checkpoint of their run; none when none
/// is there.
pub(super) fn newest(path: &Path) -> Option<Version> {
    let name = path.file_name()?.to_str()?;
    let stem = name.strip_suffix(".ply").or_else(|| name.strip_suffix(CHECKPOINT)).unwrap_or(name);
    let product = stem.split_once(STEP).map_or(stem, |(product, _)| product);
    let (prefix, whole) = (format!("{product}{STEP}"), format!("{product}.ply"));
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let is_one =
        |name: &str| name == whole || (name.starts_with(&prefix) && name.ends_with(".ply"));
    let beside = fs::read_dir(folder).into_iter().flatten().flatten();
    let versions = beside.filter(|entry| entry.file_name().to_str().is_some_and(is_one));
    let versions = versions.filter_map(|entry| version(&entry.path()));
    let named = version(path).filter(|_| !is_checkpoint(path));
    versions.chain(named).max_by(|a, b| {
        // Written within the same tick of the clock: the later step.
        a.modified.cmp(&b.modified).then_with(|| a.path.cmp(&b.path))
    })
}

fn version(path: &Path) -> Option<Version> {
    let file = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
    Some(Version { path: path.to_owned(), modified: file.modified().ok()?, bytes: file.len() })
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_newest_snapshot_of_a_product_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        assert_eq!(newest(&path("m.ply")), None);
        let names = ["m.step-000500.ply", "m.step-001000.ply", "other.step-009000.ply"];
        for (k, name) in names.iter().enumerate() {
            fs::write(path(name), "x").unwrap();
            let file = fs::File::options().write(true).open(path(name)).unwrap();
            let time = SystemTime::UNIX_EPOCH + Duration::from_secs(1000 + k as u64);
            file.set_modified(time).unwrap();
        }
        let found = |name: &str| newest(&path(name)).unwrap().path;
        assert_eq!(found("m.ply"), path(names[1]));
        assert_eq!(found(names[0]), path(names[1]));
        fs::write(path("m.checkpoint.safetensors"), "x").unwrap();
        assert_eq!(found("m.checkpoint.safetensors"), path(names[1]));
        assert_eq!(newest(&path("n.checkpoint.safetensors")), None);
        fs::write(path("m.ply"), "xx").unwrap();
        assert_eq!(found(names[1]), path("m.ply"));
    }
}
