//! What operations do, as functions on [`crate::EditState`]: no documents, no files, no flags.

pub mod clean;
pub mod clusters;
pub mod color;
pub mod decimate;
pub mod delete;
pub mod duplicate;
pub mod floaters;
pub mod free_ground;
pub mod ground;
pub mod insert;
pub(crate) mod inset;
pub mod material;
pub mod materials;
pub mod measure;
pub mod mesh;
pub mod order;
pub mod ratio_shadow;
mod spread_points;
pub mod surroundings;
pub mod transform;
