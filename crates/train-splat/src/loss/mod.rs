//! The photometric loss `(1 - λ) mean |x - y| + λ (1 - SSIM(x, y))` and its gradient.
//!
//! `x` is the rendering after the view's color transform, `y` the photo; SSIM has an 11×11
//! Gaussian window with zeros outside the image, λ = 0.2 (Kerbl et al. 2023). Pixels of weight 0
//! take `x = y`: they neither cost nor pull.

mod band;
mod photometric;
mod reference;
mod rows;
mod terms;

pub use photometric::{ColorTransform, LossValue, PhotometricLoss};
pub use reference::photometric_reference;
pub(crate) use terms::add_terms;
pub use terms::{LOSS_TERMS, LossTerm, Picture, WeightedTerm};
