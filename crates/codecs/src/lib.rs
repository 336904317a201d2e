//! Gaussians in the formats of other programs: one way in, one way out, a table of codecs between. A codec is a module
//! with a [`Codec`], named in the list below.
//!
//! `docs/formats/splats.md` describes every layout and what it loses. Frames: motes does not turn a
//! scene; a PLY keeps the axes of its source. Formats that prescribe axes (spz: right, up, back;
//! glTF: left, up, forward) are converted as their own tools convert a PLY, whose axes they take
//! as right, down, forward.

mod axes;
mod bytes;
mod merge;
mod morton;
mod open;
mod quantize;
mod r3dg;
mod registry;
mod rows;
mod write;

registry::codecs! {
    mod ply {
        /// INRIA's PLY and its relatives.
        Ply = CODEC,
    }
    mod compressed_ply {
        /// PlayCanvas's compressed PLY.
        CompressedPly = CODEC,
    }
    mod dot_splat {
        /// antimatter15's `.splat`.
        Splat = CODEC,
    }
    mod spz {
        /// Niantic's `.spz`.
        Spz = CODEC,
    }
    mod sog {
        /// PlayCanvas's SOG.
        Sog = CODEC,
    }
    mod ksplat {
        /// mkkellogg's `.ksplat`.
        Ksplat = CODEC,
    }
    mod gltf {
        /// Binary glTF with `KHR_gaussian_splatting`.
        Glb = GLB,
        /// glTF with `KHR_gaussian_splatting`, its buffers inside or beside it.
        Gltf = GLTF,
    }
    mod usda {
        /// OpenUSD text.
        Usda = CODEC,
    }
    mod table {
        /// Columns as text.
        Csv = CSV,
        /// Statistics of the columns.
        Statistics = STATISTICS,
    }
}

pub use merge::merge_gaussians;
pub use open::{open_gaussians, read_gaussians, read_gaussians_from};
pub use ply::PlyLayout;
pub use registry::Codec;
pub use sog::SogOptions;
pub use spz::SpzOptions;
pub use write::{SplatWriteOptions, write_gaussians, write_gaussians_to};

#[cfg(test)]
mod tests;
