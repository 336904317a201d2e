//! Exporting: splats and decomposed scenes as assets that other programs open.

pub mod files;
pub mod html;
pub mod mesh;
mod options;
pub mod shadow;
