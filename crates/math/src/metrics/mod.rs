//! Image quality measures with their protocol in the name.

mod affine;
mod psnr;
mod ssim;

pub use affine::fit_affine_rgb;
pub use psnr::{mean_squared_error, psnr_f32, psnr_from_mse};
pub use ssim::{SsimBorder, ssim, ssim_of_pixels};
