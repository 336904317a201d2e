//! glTF: Gaussians where it has some, else what its document lists.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use motes_formats::documents::syntax_error;
use motes_formats::{FormatError, Result};
use serde_json::Value;

use super::splats;
use crate::{Description, Kind};

const EXTENSION: &str = "KHR_gaussian_splatting";
/// A binary glTF starts with magic, version, length, and the length and type of its JSON chunk.
const GLB_HEADER_BYTES: usize = 20;
/// A document has no more; buffers are outside it, or encoded in it.
const MAX_JSON_BYTES: u64 = 1 << 30;
/// Lists that are counted.
const LISTS: [&str; 7] =
    ["nodes", "meshes", "materials", "textures", "cameras", "animations", "skins"];

/// A glTF of either kind.
///
/// # Errors
/// It is broken.
pub(super) fn describe(path: &Path) -> Result<Description> {
    let (document, binary) = document(path)?;
    let generator = document.pointer("/asset/generator").and_then(Value::as_str);
    let used = |key: &str| document[key].as_array().into_iter().flatten().any(|v| v == EXTENSION);
    let mut found = if used("extensionsUsed") || used("extensionsRequired") {
        splats::describe(path)?
    } else {
        let kind = Description::new(Kind::Model, if binary { "glb" } else { "gltf" });
        LISTS.iter().fold(kind, |found, list| match document[*list].as_array() {
            Some(items) => found.count(list, items.len()),
            None => found,
        })
    };
    found.made_by = generator.map(str::to_owned);
    Ok(found.fact("extensions", document["extensionsUsed"].clone()))
}

/// The JSON of a file, and whether it is binary glTF.
fn document(path: &Path) -> Result<(Value, bool)> {
    let io = |error| FormatError::io(path, error);
    let mut file = File::open(path).map_err(io)?.take(MAX_JSON_BYTES);
    let mut bytes = Vec::new();
    (&mut file).take(GLB_HEADER_BYTES as u64).read_to_end(&mut bytes).map_err(io)?;
    let binary = bytes.starts_with(b"glTF");
    if binary {
        let length = bytes.get(12..16).and_then(|length| length.try_into().ok());
        let length = u64::from(length.map_or(0, u32::from_le_bytes));
        bytes.clear();
        file.take(length).read_to_end(&mut bytes).map_err(io)?;
        if (bytes.len() as u64) < length {
            let cause = format!("the JSON chunk claims {length} bytes, the file ends before");
            return Err(FormatError::invalid(path, "byte 12", cause));
        }
    } else {
        file.read_to_end(&mut bytes).map_err(io)?;
    }
    let document =
        serde_json::from_slice(&bytes).map_err(|error| syntax_error(&bytes, path, &error))?;
    Ok((document, binary))
}
