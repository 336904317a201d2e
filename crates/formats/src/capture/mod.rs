//! `capture.json`: cameras, posed views and sparse points of one scene.
//!
//! `docs/formats/capture.md` is normative. Image, mask and point files are named relative to the
//! folder of the document, with `/` between parts, and never lead out of it.

mod document;
mod from_document;
mod to_document;

use std::path::{Path, PathBuf};

use motes_scene::Capture;

use crate::documents::{read_document, write_document};
use crate::error::{FormatError, Result, quoted};
use crate::ply;

pub use document::{CameraDocument, CaptureDocument, Conventions, PoseDocument, ViewDocument};
pub use from_document::capture_from_document;
pub use from_document::checked_relative_path;
pub(crate) use from_document::pose_from_document;
pub(crate) use to_document::pose_to_document;

/// File name that [`write_capture`] gives the points.
pub const POINTS_FILE: &str = "points.ply";

/// Reads a capture and its points. See [`read_capture_with_warnings`].
///
/// # Errors
/// As [`read_capture_with_warnings`].
pub fn read_capture(path: &Path) -> Result<Capture> {
    read_capture_with_warnings(path).map(|(capture, _)| capture)
}

/// Reads a capture and its points, and what a reader should know: sentences about ignored keys.
/// Views come sorted by name. Images are not opened.
///
/// # Errors
/// A file cannot be read or is malformed; a view refers to a camera that does not exist; names
/// repeat; a focal length, size, pose or parameter is impossible; a file name is absolute or leads
/// out of the folder of the document.
pub fn read_capture_with_warnings(path: &Path) -> Result<(Capture, Vec<String>)> {
    let parsed = read_document::<CaptureDocument>(path)?;
    let mut capture = capture_from_document(&parsed.document, path)?;
    if let Some(name) = &parsed.document.points {
        let points = resolve(path, &checked_relative_path(path, "points", name)?);
        if !points.exists() {
            let cause = format!("the file {} does not exist", quoted(name));
            return Err(FormatError::invalid(path, "points", cause)
                .with_remedy("keep the files of a capture together, or set \"points\" to null"));
        }
        capture.points = ply::read_points(&points)?;
    }
    Ok((capture, parsed.warnings))
}

/// Writes a capture, and its points as `points.ply` beside it when there are any.
///
/// # Errors
/// Writing fails, or a file name is not UTF-8, absolute, or leads out of the folder.
pub fn write_capture(path: &Path, capture: &Capture) -> Result<()> {
    let document = to_document::capture_to_document(capture, path)?;
    // First, so that a document never names points that are not there.
    if !capture.points.is_empty() {
        ply::write_points(&resolve(path, Path::new(POINTS_FILE)), &capture.points)?;
    }
    write_document(path, &document)
}

/// The path of a file that a document names, from the path of the document.
pub fn resolve(document: &Path, file: &Path) -> PathBuf {
    document.parent().map_or_else(|| file.to_owned(), |folder| folder.join(file))
}

#[cfg(test)]
mod tests;
