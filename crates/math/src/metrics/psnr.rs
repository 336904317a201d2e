//! Peak signal-to-noise ratio.

/// Mean squared difference, accumulated in double precision.
///
/// # Panics
/// When the lengths differ.
pub fn mean_squared_error(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len(), "images of one size");
    let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    sum / a.len().max(1) as f64
}

/// `-10 log10(mse)` for values with peak 1, in dB; infinite for equal images.
pub fn psnr_from_mse(mse: f64) -> f64 {
    -10.0 * mse.log10()
}

/// PSNR in dB over all pixels and channels of two images with values in [0, 1].
pub fn psnr_f32(a: &[f32], b: &[f32]) -> f64 {
    psnr_from_mse(mean_squared_error(a, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert!((psnr_f32(&[0.0; 12], &[0.1; 12]) - 20.0).abs() < 1e-5);
        assert_eq!(psnr_f32(&[0.5; 3], &[0.5; 3]), f64::INFINITY);
    }
}
