//! Finding the file that a model means.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Suffixes of image files that can be decoded, lower case.
pub(crate) const SUFFIXES: [&str; 8] = ["png", "jpg", "jpeg", "tif", "tiff", "webp", "bmp", "ppm"];

/// Looks up images below a folder; reads each subfolder once.
pub(crate) struct ImageFinder {
    root: PathBuf,
    folders: HashMap<PathBuf, Vec<String>>,
}

impl ImageFinder {
    pub(crate) fn new(root: &Path) -> Self {
        Self { root: root.to_path_buf(), folders: HashMap::new() }
    }

    /// The file for a `/`-separated name: exactly it; with a suffix added (the NeRF-synthetic set
    /// leaves it away); or the same name with other letter case or another image suffix, when
    /// there is exactly one such file (photos converted after the poses were found).
    pub(crate) fn find(&mut self, name: &str) -> Option<PathBuf> {
        let exact = self.root.join(name);
        if exact.is_file() {
            return Some(exact);
        }
        for suffix in SUFFIXES {
            let file = self.root.join(format!("{name}.{suffix}"));
            if file.is_file() {
                return Some(file);
            }
        }
        let wanted = stem(name.rsplit('/').next().unwrap_or(name)).to_lowercase();
        let folder = exact.parent()?.to_path_buf();
        let files = self.folders.entry(folder.clone()).or_insert_with(|| list(&folder));
        let mut alike = files.iter().filter(|file| stem(file).to_lowercase() == wanted);
        match (alike.next(), alike.next()) {
            (Some(only), None) => Some(folder.join(only)),
            _ => None,
        }
    }
}

fn stem(file: &str) -> &str {
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

fn list(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|e| e.file_name().into_string().ok()).filter(|f| is_image(f)).collect()
}

/// Whether a file name has the suffix of an image.
pub(crate) fn is_image(file: &str) -> bool {
    let suffix = file.rsplit_once('.').map_or(String::new(), |(_, s)| s.to_lowercase());
    SUFFIXES.contains(&suffix.as_str())
}

/// The mask of a photo in a folder of masks: `name.png`, `name.jpg.png` or `name.mask.png`, in
/// the same subfolder.
pub(crate) fn find_mask(masks: &Path, name: &str) -> Option<PathBuf> {
    let (folder, file) = name.rsplit_once('/').map_or(("", name), |(folder, file)| (folder, file));
    let bare = stem(file);
    [format!("{file}.png"), format!("{bare}.mask.png"), format!("{bare}.png"), file.to_string()]
        .iter()
        .map(|candidate| masks.join(folder).join(candidate))
        .find(|path| path.is_file())
}
