//! Scores renders against photos under a stated protocol, and shows them on a page.
//!
//! - [`score`]: PSNR, SSIM, LPIPS, color-corrected PSNR of a view; means; bounds.
//! - [`evaluation`]: contestants against the photos of a capture.
//! - [`lpips`]: the perceptual distance, with the user's own weights.
//! - [`page`], [`training_curves`]: the page and its pictures.
//! - [`files`]: the command line.
//!
//! Invariants: a value that is not finite never reaches a document; results do not depend on the
//! number of threads.

pub mod evaluation;
pub mod files;
pub mod lpips;
pub mod page;
pub mod score;
pub mod training_curves;
