//! PlayCanvas's compressed PLY: 16 bytes per Gaussian and a byte per harmonic.
//!
//! Elements `chunk` (256 Gaussians: bounds of position, log scale and color), `vertex` (four
//! packed u32) and, for degrees above 0, `sh` (one u8 per coefficient, channel-major).

mod read;
mod write;

use super::registry::{Codec, Input};
pub(crate) use read::{is_compressed, read_compressed};

pub(super) static CODEC: Codec = Codec {
    name: "compressed-ply",
    about: "PlayCanvas compressed PLY",
    suffixes: &[".compressed.ply"],
    loses: "quantized; other columns; the order of rows",
    // Told from other PLY files by its header.
    read: Input::Ply,
    write: Some(write::write),
    ..Codec::DEFAULT
};

/// Gaussians that share bounds.
const CHUNK: usize = 256;
/// Bounds of a chunk, in file order: `min_*` and `max_*` of three values each.
const BOUNDS: [&str; 18] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
    "min_r",
    "min_g",
    "min_b",
    "max_r",
    "max_g",
    "max_b",
];
/// Columns of `vertex`.
const PACKED: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];
/// Coefficients are stored as -4 to 4.
const SH_RANGE: f32 = 8.0;
