//! Differentiable splatting of 3D Gaussians on the CPU.
//!
//! Image formation (Kerbl et al. 2023, "3D Gaussian Splatting"; Zwicker et al. 2001, EWA):
//! a Gaussian projects to a 2D Gaussian, `alpha = min(0.99, opacity exp(-Q/2))`, and the pixels
//! composite front to back, `color = Σ c_i alpha_i T_i + T background`, `T_{i+1} = T_i (1 - alpha_i)`.
//!
//! - [`mod@reference`]: the equations in double precision, one loop each: the oracle of the tests.
//! - [`Frame`]: the tiled SIMD path, forward and backward.
//! - [`fn@render`]: one picture with its AOVs; [`Painter`]: one view in several sets of colors.
//!
//! Invariants: forward and backward decide with the same function whether a Gaussian touches a
//! pixel; a comparison that decides is written so that NaN means "no"; results do not depend on
//! the number of threads.

mod aovs;
mod backward;
mod batch;
mod binning;
mod equirectangular;
mod exp2;
mod footprint;
mod forward;
mod frame;
mod gradients;
mod lanes;
mod options;
mod parameters;
mod planes;
mod project;
mod project_backward;
pub mod reference;
mod render;
mod resort;
#[cfg(test)]
mod scalar;
mod scalars;
mod shade;
mod simd;
mod sort;
mod spans;
mod splat;
mod strip;
mod view;
mod votes;

pub use equirectangular::render_equirectangular;
pub use frame::{Frame, FrameStats, PhaseClock};
pub use gradients::GaussianGradients;
pub use options::{
    ALPHA_MAX, ALPHA_MIN, Antialias, BLUR_VARIANCE_PX2, Modifiers, RenderOptions, TILE,
    TRANSMITTANCE_MIN,
};
pub use parameters::{Accumulation, RasterParameters, SimdLevel, Sorting};
pub use planes::Planes;
pub use render::{Aovs, Painter, Rendering, render, render_depth_median};
pub use scalars::render_scalars;
pub use view::ViewTransform;
pub use votes::{LabelVotes, NO_LABEL, label_votes};
