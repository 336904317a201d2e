//! Which reader a file or folder belongs to: by its first bytes, and by its name where they say nothing.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use motes_codecs::SplatFormat;
use motes_formats::{FormatError, Result, colmap, images};

use super::{documents, folders, gltf, images as pictures, made_by, ply, splats, tensors};
use crate::{Description, Kind};

/// Bytes that tell kinds apart.
const OPENING_BYTES: u64 = 16;
const EXR_MAGIC: &[u8] = &[0x76, 0x2f, 0x31, 0x01];

/// What is at `path`.
///
/// # Errors
/// It is missing, or it is of a known kind and broken.
pub(super) fn describe(path: &Path) -> Result<Description> {
    let io = |error| FormatError::io(path, error);
    let metadata = std::fs::metadata(path).map_err(io)?;
    let mut description = match metadata.is_dir() {
        true => folders::describe(path)?,
        false => {
            let file = File::open(path).map_err(io)?;
            let mut opening = Vec::new();
            // A pipe cannot be opened twice.
            if metadata.is_file() {
                file.take(OPENING_BYTES).read_to_end(&mut opening).map_err(io)?;
            }
            let found = of_file(path, &opening)?;
            Description { bytes: metadata.is_file().then_some(metadata.len()), ..found }
        }
    };
    description.path = path.to_owned();
    made_by::add_run_record(&mut description, path);
    Ok(description)
}

fn of_file(path: &Path, opening: &[u8]) -> Result<Description> {
    let suffix = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let named = |names: &[&str]| path.file_name().is_some_and(|n| names.iter().any(|m| n == *m));
    let is_json = opening.trim_ascii_start().starts_with(b"{")
        || opening.starts_with(b"\xef\xbb\xbf{")
        || suffix == "json";
    if opening.starts_with(b"ply") || suffix == "ply" {
        return ply::describe(path);
    }
    if opening.starts_with(EXR_MAGIC) {
        return pictures::describe_exr(path);
    }
    if opening.starts_with(b"glTF") || suffix == "gltf" {
        return gltf::describe(path);
    }
    // `meta.json` is that of a SOG, unless it says that it is something else.
    if is_json && (!named(&["meta.json"]) || documents::has_format(path)?) {
        return documents::describe(path);
    }
    if suffix == "safetensors" || tensors::starts_like(opening) {
        return tensors::describe(path);
    }
    let models = ["cameras", "images", "points3D"];
    let is_model =
        models.iter().any(|stem| named(&[&format!("{stem}.bin"), &format!("{stem}.txt")]));
    if let Some(folder) =
        path.parent().filter(|folder| is_model && colmap::layout_of(folder).is_some())
    {
        return folders::describe_colmap(folder);
    }
    if let Ok(size) = images::image_dimensions(path) {
        return Ok(pictures::describe_picture(size, &suffix));
    }
    match SplatFormat::of_name(path) {
        Some(format) if format.codec().is_readable() => splats::describe(path),
        _ if opening.starts_with(&[0x1f, 0x8b]) || opening.starts_with(b"NGSP") => {
            splats::describe(path)
        }
        _ => Ok(Description::new(Kind::Unknown, "")),
    }
}
