//! Where a model lies in a project folder.

use std::path::{Path, PathBuf};

/// Encoding of a model's files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// `.bin`, little endian.
    Binary,
    /// `.txt`.
    Text,
}

impl Layout {
    /// File suffix without the dot.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Binary => "bin",
            Self::Text => "txt",
        }
    }
}

/// The encoding of the model in a folder, binary first; `None` when no complete model is there.
pub fn layout_of(directory: &Path) -> Option<Layout> {
    [Layout::Binary, Layout::Text].into_iter().find(|layout| {
        ["cameras", "images"]
            .iter()
            .all(|stem| directory.join(format!("{stem}.{}", layout.suffix())).is_file())
    })
}

/// Folders that hold a model in a COLMAP project, in the order to try: the folder itself,
/// `sparse`, `sparse/N` by number, then the places where nerfstudio puts them, then `N` by number, for a project that is
/// itself a folder `sparse`.
pub fn find_models(project: &Path) -> Vec<PathBuf> {
    let mut found = vec![project.to_path_buf()];
    found.retain(|directory| layout_of(directory).is_some());
    for name in ["sparse", "colmap/sparse", "sparse_txt", ""] {
        let parent = if name.is_empty() { project.to_owned() } else { project.join(name) };
        let entries = std::fs::read_dir(&parent).into_iter().flatten().flatten();
        let mut numbered: Vec<u32> =
            entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).collect();
        numbered.sort_unstable();
        let numbered = numbered.iter().map(|number| parent.join(number.to_string()));
        let itself = Some(parent.clone()).filter(|_| !name.is_empty());
        let candidates = itself.into_iter().chain(numbered);
        found.extend(candidates.filter(|directory| layout_of(directory).is_some()));
        if !found.is_empty() {
            break;
        }
    }
    found
}
