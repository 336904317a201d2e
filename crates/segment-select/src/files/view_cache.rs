//! Where prepared views are kept when nothing is said.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use motes_formats::selection::sha256_of_bytes;

/// Prepared views take no more than this, bytes; those that were not used for the longest time go first.
const MOST_BYTES: u64 = 1 << 30;

/// `motes/views` in the user's folder of caches, made; none where there is no such folder or nothing can be written.
///
/// Views that another build prepared lie in another folder there: what it computes may differ.
pub fn usual_folder() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from);
    let absolute = |folder: &PathBuf| folder.is_absolute();
    let caches = variable("XDG_CACHE_HOME").filter(absolute);
    let caches = caches.or_else(|| Some(variable("HOME").filter(absolute)?.join(".cache")))?;
    let views = caches.join("motes").join("views");
    let folder = views.join(build()?);
    fs::create_dir_all(&folder).ok()?;
    let probe = folder.join(format!(".{}", std::process::id()));
    fs::write(&probe, b"").and_then(|()| fs::remove_file(&probe)).ok()?;
    prune(&views, MOST_BYTES);
    Some(folder)
}

/// Names this program by its file.
fn build() -> Option<String> {
    let file = fs::metadata(std::env::current_exe().ok()?).ok()?;
    let written = file.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    let key = format!("{} {}", file.len(), written.as_nanos());
    Some(sha256_of_bytes(key.as_bytes())[..16].to_owned())
}

/// Removes the files of `folder` that were not used for the longest time until `most` bytes are left. What cannot be removed stays.
fn prune(folder: &Path, most: u64) {
    let mut files = files_below(folder);
    files.sort_by(|a, b| b.used.cmp(&a.used).then_with(|| a.path.cmp(&b.path)));
    let mut sum = 0u64;
    for file in files {
        sum = sum.saturating_add(file.bytes);
        if sum > most {
            // Another run may have done it.
            let _ = fs::remove_file(&file.path);
        }
    }
}

struct Kept {
    path: PathBuf,
    bytes: u64,
    used: SystemTime,
}

/// Prepared views in the folders of `folder`.
fn files_below(folder: &Path) -> Vec<Kept> {
    let entries = |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found = Vec::new();
    for build in entries(folder) {
        for entry in entries(&build.path()) {
            let is_view = entry.path().extension().is_some_and(|end| end == "safetensors");
            let Ok(file) = entry.metadata() else { continue };
            if let (true, true, Ok(used)) = (is_view, file.is_file(), file.modified()) {
                found.push(Kept { path: entry.path(), bytes: file.len(), used });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn what_was_not_used_for_the_longest_time_goes_first() {
        let folder = tempfile::tempdir().unwrap();
        let build = folder.path().join("b");
        fs::create_dir(&build).unwrap();
        for (k, name) in ["old.safetensors", "new.safetensors", "older.txt"].iter().enumerate() {
            let path = build.join(name);
            fs::write(&path, [0; 100]).unwrap();
            let used = SystemTime::UNIX_EPOCH + Duration::from_secs(1000 * (k as u64 % 2));
            fs::File::options().write(true).open(path).unwrap().set_modified(used).unwrap();
        }
        let left = || {
            let mut names: Vec<String> = fs::read_dir(&build)
                .unwrap()
                .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
                .collect();
            names.sort();
            names
        };
        prune(folder.path(), 200);
        assert_eq!(left().len(), 3);
        prune(folder.path(), 150);
        assert_eq!(left(), ["new.safetensors", "older.txt"]);
    }
}
