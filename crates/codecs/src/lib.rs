//! Gaussians in the formats of other programs: one way in, one way out, a table of codecs between. A codec is a module
//! with a [`Codec`], named in the list below.
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
pub mod mesh;
mod morton;
mod open;
mod open_mesh;
mod options;
mod ply;
mod quantize;
mod r3dg;
mod registry;
mod rows;
mod sog;
mod spz;
mod table;
mod usda;
mod write;

registry::codecs! {
    /// INRIA's PLY and its relatives.
    Ply = ply::CODEC,
    /// PlayCanvas's compressed PLY.
    CompressedPly = compressed_ply::CODEC,
    /// antimatter15's `.splat`.
    Splat = dot_splat::CODEC,
    /// Niantic's `.spz`.
    Spz = spz::CODEC,
    /// PlayCanvas's SOG.
    Sog = sog::CODEC,
    /// mkkellogg's `.ksplat`.
    Ksplat = ksplat::CODEC,
    /// Binary glTF with `KHR_gaussian_splatting`.
    Glb = gltf::GLB,
    /// glTF with `KHR_gaussian_splatting`, its buffers inside or beside it.
    Gltf = gltf::GLTF,
    /// OpenUSD text.
    Usda = usda::CODEC,
    /// Columns as text.
    Csv = table::CSV,
    /// Statistics of the columns.
    Statistics = table::STATISTICS,
}

pub use merge::merge_gaussians;
pub use open::{open_gaussians, read_gaussians, read_gaussians_from};
pub use open_mesh::{MESH_FORMATS, open_mesh};
pub use options::{PlyLayout, SogOptions, SplatWriteOptions, SpzOptions};
pub use registry::Codec;
pub use write::{write_gaussians, write_gaussians_to};

#[cfg(test)]
mod tests;
