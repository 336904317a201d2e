//! glTF with `KHR_gaussian_splatting`, as ratified by Khronos in 2026.
//!
//! A primitive of points with an accessor per attribute: position, rotation `x, y, z, w`, scale (linear),
//! opacity (0 to 1), a VEC3 per harmonic, and a color for viewers that do not know the extension. Axes are left, up,
//! forward. Columns beyond the standard ones travel as application attributes `_NAME`.

mod accessor;
mod columns;
mod document;
mod glb;
mod mesh;
mod opened;
mod read;
mod write;

pub(super) use mesh::read_mesh;

use super::registry::{Codec, Input};

pub(super) static GLB: Codec = Codec {
    name: "glb",
    about: "Binary glTF with KHR_gaussian_splatting",
    suffixes: &[".glb"],
    max_sh_degree: MAX_DEGREE,
    lossless: true,
    keeps_extra_columns: true,
    loses: "rounding; columns of 32-bit integers and doubles",
    starts: is_glb,
    read: Input::Bytes(read::read),
    write: Some(write::write),
    ..Codec::DEFAULT
};

pub(super) static GLTF: Codec = Codec {
    name: "gltf",
    about: "glTF with KHR_gaussian_splatting, its buffers inside or beside it",
    suffixes: &[".gltf"],
    starts: |_| false,
    write: None,
    ..GLB
};

/// The extension and the prefix of its attributes.
const EXTENSION: &str = "KHR_gaussian_splatting";
const MAGIC: &[u8] = b"glTF";
/// Harmonics end at this degree.
const MAX_DEGREE: u8 = 3;

/// Names of the harmonics up to a degree, in the order of the coefficients.
fn harmonic_names(degree: u8) -> impl Iterator<Item = String> {
    (0..=degree)
        .flat_map(|l| (0..2 * l + 1).map(move |n| format!("{EXTENSION}:SH_DEGREE_{l}_COEF_{n}")))
}

/// Whether a file that starts so is a binary glTF.
fn is_glb(start: &[u8]) -> bool {
    start.starts_with(MAGIC)
}
