//! The loss in double precision, straight from its definition.

use motes_math::metrics::{SsimBorder, ssim};

/// `(1 - λ) mean |x - y| + λ (1 - SSIM)` of two interleaved RGB images in [0, 1].
pub fn photometric_reference(
    x: &[f32],
    y: &[f32],
    width: usize,
    height: usize,
    ssim_weight: f64,
) -> f64 {
    let l1: f64 =
        x.iter().zip(y).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / x.len().max(1) as f64;
    (1.0 - ssim_weight) * l1 + ssim_weight * (1.0 - ssim(x, y, width, height, 3, SsimBorder::Same))
}
