//! Inverse rendering: from a capture and its Gaussians to a surface, its material and the light.

mod attributes;
mod buffers;
mod cavities;
mod conjugate_gradients;
mod decompose;
mod evidence;
pub mod files;
pub mod geometry;
mod illumination;
pub mod light;
pub mod materials;
mod normal_priors;
mod observed;
mod options;
mod photo;
mod photo_fit;
pub mod pixels;
mod reflection;
mod relief;
mod rendered;
mod residual;
pub mod samples;
mod sheets;
mod slopes;
pub mod splat_colors;
#[cfg(test)]
mod toy_ball;

pub use buffers::{PixelHit, TracedSurface, ViewRays};
pub use decompose::{
    Anchor, DecomposeError, Decomposition, Known, Observer, RenderedView, decompose,
};
pub use illumination::ReflectedLight;
pub use options::{DecomposeOptions, LobesChoice, TermChoice};
pub use photo::Photo;
pub use reflection::MirrorRound;
pub use relief::ReliefReport;
pub use residual::{ResidualOptions, ResidualView, fit_residual};
pub use sheets::up_in_world;
