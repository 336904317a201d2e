//! Gaussians in the formats of other programs: one way in, one way out, a table of codecs between.
//!
//! `docs/formats/splats.md` describes every layout and what it loses. Frames: motes does not turn a
//! scene; a PLY keeps the axes of its source. Formats that prescribe axes (spz: right, up, back;
//! glTF: left, up, forward) are converted as their own tools convert a PLY, whose axes they take
//! as right, down, forward.

mod axes;
mod bytes;
mod compressed_ply;
mod dot_splat;
mod gltf;
mod ksplat;
mod merge;
mod morton;
mod open;
mod quantize;
mod r3dg;
mod registry;
mod rows;
mod sog;
mod spz;
mod table;
mod usda;
mod write;

pub use merge::merge_gaussians;
pub use open::{open_gaussians, read_gaussians, read_gaussians_from};
pub use registry::{CODECS, Codec, SplatFormat};
pub use sog::SogOptions;
pub use spz::SpzOptions;
pub use write::{PlyLayout, SplatWriteOptions, write_gaussians, write_gaussians_to};

#[cfg(test)]
mod tests;
