//! Files that an instruction may insert: those of one folder.

use std::path::Path;

use motes_stage::{Context, StageError};

/// Names that are told to a reader or a model.
const MOST: usize = 1000;
/// Suffixes of what `edit` inserts or lights with.
const SUFFIXES: [&str; 10] =
    ["glb", "gltf", "obj", "ply", "spz", "splat", "ksplat", "sog", "exr", "hdr"];

/// Names of the files in a folder that can be inserted, sorted. Links that lead out of it are left out.
pub(super) fn assets(folder: &Path, context: &Context) -> anyhow::Result<Vec<String>> {
    if !folder.is_dir() {
        let cause = format!("there is no folder of assets: {}", folder.display());
        return Err(StageError::bad_input(cause).help("--assets takes a folder").into());
    }
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let suffix = path.extension().and_then(|s| s.to_str()).unwrap_or_default();
        let known = SUFFIXES.contains(&suffix.to_ascii_lowercase().as_str());
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { continue };
        if known && path.is_file() && is_below(&path, folder) {
            found.push(name.to_owned());
        }
    }
    found.sort();
    if found.len() > MOST {
        context.warn(format!(
            "{} has {} files; the first {MOST} count",
            folder.display(),
            found.len()
        ));
        found.truncate(MOST);
    }
    Ok(found)
}

/// Whether a file is there and lies below a folder, wherever links lead.
pub(super) fn is_below(file: &Path, folder: &Path) -> bool {
    match (file.canonicalize(), folder.canonicalize()) {
        (Ok(file), Ok(folder)) => file.starts_with(folder),
        _ => false,
    }
}
