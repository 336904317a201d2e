//! PlayCanvas's SOG, version 2: attributes as images.
//!
//! A zip archive (`.sog`), or a folder, of `meta.json` and lossless WebP images with a pixel per
//! Gaussian: positions as two bytes per axis of `sign(v) ln(1 + |v|)`, rotations as their three
//! smallest components, scales and colors as indices into codebooks, opacity as a byte, harmonics as a
//! label of a palette whose values are indices into a codebook. Axes are those of the PLY.

mod archive;
mod images;
mod meta;
mod read;
mod write;

use motes_formats::error::FormatError;

use super::registry::{Codec, Input};
pub(super) use read::read_folder;

pub(super) static CODEC: Codec = Codec {
    name: "sog",
    about: "PlayCanvas SOG",
    suffixes: &[".sog"],
    loses: "quantized; other columns; the order of rows",
    versions: ["version 2, also `meta.json`", "version 2"],
    starts: is_archive,
    read: Input::Bytes(read::read),
    write: Some(write::write),
    ..Codec::DEFAULT
};

/// Values of a codebook, and colors of a palette per row of its image.
const CODEBOOK: usize = 256;
const PALETTE_COLUMNS: usize = 64;
/// A label has two bytes.
const MOST_PALETTE: usize = 1 << 16;
/// The alpha of a rotation's pixel is this plus the index of its largest component.
const ROTATION_TAG: u8 = 252;

/// Whether a file that starts so is an archive.
pub(super) fn is_archive(start: &[u8]) -> bool {
    start.starts_with(b"PK\x03\x04")
}

/// A fault of one file of the archive.
fn fault(path: &std::path::Path, file: &str, cause: impl Into<String>) -> FormatError {
    FormatError::invalid(path, file, cause)
}
