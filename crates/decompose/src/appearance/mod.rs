//! How a surface looks under a light: the model's options, its terms as linear functions of base color, its materials.

pub(crate) mod basis;
pub(crate) mod half_pixels;
pub(crate) mod material;
pub(crate) mod options;
pub(crate) mod pixel_shading;
mod sparse;
pub(crate) mod vertex_materials;

pub(crate) use basis::BasisScene;
pub use material::{FoundMaterials, Kind, PartMaterial, ScaleEvidence};
pub use options::ModelOptions;
pub use pixel_shading::PixelShading;
pub(crate) use pixel_shading::SparsePixels;
pub(crate) use vertex_materials::VertexMaterials;
