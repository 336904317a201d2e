//! Inverse rendering: from a capture and its Gaussians to a surface, its material and the light.

pub mod geometry;
mod photo;

pub use photo::Photo;
