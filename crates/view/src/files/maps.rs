//! Environment maps that the page offers.

use std::fs;
use std::path::{Path, PathBuf};

use motes_stage::{Context, StageError};

use super::named::absolute;
use crate::session::OfferedMap;

/// Maps that the page offers at most.
const MOST: usize = 200;
const SUFFIXES: [&str; 2] = ["exr", "hdr"];

/// The maps of folders, by name: files with a suffix of a map that lie in them. They are read when they are chosen.
///
/// # Errors
/// A folder cannot be listed.
pub(super) fn maps(folders: &[PathBuf], context: &Context) -> anyhow::Result<Vec<OfferedMap>> {
    let mut found = Vec::new();
    for folder in folders {
        found.extend(in_folder(folder)?);
    }
    if found.len() > MOST {
        context.warn(format!("{} environment maps: the page offers {MOST} of them", found.len()));
        found.truncate(MOST);
    }
    Ok(found)
}

fn in_folder(folder: &Path) -> Result<Vec<OfferedMap>, StageError> {
    let failed = |error: std::io::Error| {
        StageError::bad_input(format!("the folder cannot be listed: {}: {error}", folder.display()))
    };
    let root = fs::canonicalize(folder).map_err(failed)?;
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let suffix = path.extension().and_then(|suffix| suffix.to_str()).unwrap_or_default();
        // A link that leads out of the folder is not offered.
        let inside = fs::canonicalize(&path).is_ok_and(|full| full.starts_with(&root));
        let is_map = SUFFIXES.iter().any(|known| suffix.eq_ignore_ascii_case(known));
        if is_map && inside && path.is_file() {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            found.push(OfferedMap { name, file: absolute(&path) });
        }
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(found)
}
