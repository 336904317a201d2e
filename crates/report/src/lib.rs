//! Scores renders against photos, and makes pictures and pages of the results.
//!
//! - [`score`]: PSNR, SSIM, LPIPS, colour-corrected PSNR of a view; means; bounds.
//! - [`evaluation`]: contestants against the photos of a capture under a stated protocol.
//! - [`lab_files`]: the folders of the lab's runs; [`relight_files`]: a relit scene.
//! - [`lpips`]: the perceptual distance, with the user's own weights.
//! - [`photos`]: the pictures that are compared.
//! - [`model`]: Gaussians and how they want to be drawn.
//! - [`frames`]: which pictures to render, and the files they become.
//! - [`pages`]: the documents that stages write.
//! - [`html`], [`svg_plot`], [`contact_sheet`], [`error_map`], [`colormap`], [`canvas`]: values
//!   in, bytes or text out.
//!
//! Invariants: a page is one file that needs no network; a value that is not finite never
//! reaches a document; results do not depend on the number of threads.

pub mod canvas;
pub mod colormap;
pub mod contact_sheet;
pub mod error_map;
pub mod evaluation;
pub mod frames;
pub mod html;
pub mod lab_files;
pub mod lpips;
pub mod model;
pub mod pages;
pub mod photos;
pub mod relight_files;
pub mod score;
pub mod svg_plot;
pub mod training_curves;
