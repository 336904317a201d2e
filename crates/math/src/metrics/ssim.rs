//! Structural similarity with an 11×11 Gaussian window.
//!
//! SSIM = (2 μa μb + C1)(2 σab + C2) / ((μa² + μb² + C1)(σa² + σb² + C2)), window σ = 1.5,
//! C1 = 0.01², C2 = 0.03² (peak 1), averaged over pixels and channels. Source: Wang, Bovik,
//! Sheikh, Simoncelli (2004).

use clap::ValueEnum;
use serde::Serialize;

/// How windows that reach over the image border count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SsimBorder {
    /// Every pixel counts; outside is zero (INRIA 3DGS, and the training loss).
    #[default]
    Same,
    /// Only windows that lie inside count (scikit-image crop, torchmetrics).
    Valid,
}

impl SsimBorder {
    /// The word of flags and documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Valid => "valid",
        }
    }
}

/// Taps on each side of the center.
const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Normalized 1-D window; the 2-D window is its outer product.
fn ssim_window() -> [f64; 2 * RADIUS + 1] {
    let mut window = [0.0; 2 * RADIUS + 1];
    for (i, w) in window.iter_mut().enumerate() {
        let d = i as f64 - RADIUS as f64;
        *w = (-d * d / (2.0 * SIGMA * SIGMA)).exp();
    }
    let sum: f64 = window.iter().sum();
    window.map(|w| w / sum)
}

fn blur(values: &[f64], width: usize, height: usize) -> Vec<f64> {
    let window = ssim_window();
    let tap = |line: &dyn Fn(usize) -> f64, center: usize, length: usize| -> f64 {
        let from = center.saturating_sub(RADIUS);
        let to = (center + RADIUS + 1).min(length);
        (from..to).map(|i| window[i + RADIUS - center] * line(i)).sum()
    };
    let mut rows = vec![0.0; values.len()];
    for y in 0..height {
        for x in 0..width {
            rows[y * width + x] = tap(&|i| values[y * width + i], x, width);
        }
    }
    let mut out = vec![0.0; values.len()];
    for y in 0..height {
        for x in 0..width {
            out[y * width + x] = tap(&|i| rows[i * width + x], y, height);
        }
    }
    out
}

/// Mean SSIM of two interleaved images `[height, width, channels]` with values in [0, 1].
///
/// Double precision throughout: this is the measuring path, the training loss has its own.
/// [`SsimBorder::Valid`] on an image smaller than 11 pixels falls back to `Same`, since no window
/// fits inside. Returns 1 for an image without pixels.
///
/// # Panics
/// When a length is not `width * height * channels`.
pub fn ssim(
    a: &[f32],
    b: &[f32],
    width: usize,
    height: usize,
    channels: usize,
    border: SsimBorder,
) -> f64 {
    mean_ssim(a, b, width, height, channels, border, None)
}

/// As [`ssim`], averaged over the windows centered on counted pixels only (`counted`: one flag per
/// pixel, row-major). NaN when no pixel counts.
///
/// Windows still see their uncounted neighbors, so give both images the same values there.
///
/// # Panics
/// When a length is wrong.
pub fn ssim_of_pixels(
    a: &[f32],
    b: &[f32],
    width: usize,
    height: usize,
    channels: usize,
    border: SsimBorder,
    counted: &[bool],
) -> f64 {
    assert_eq!(counted.len(), width * height, "one flag per pixel");
    mean_ssim(a, b, width, height, channels, border, Some(counted))
}

fn mean_ssim(
    a: &[f32],
    b: &[f32],
    width: usize,
    height: usize,
    channels: usize,
    border: SsimBorder,
    counted: Option<&[bool]>,
) -> f64 {
    assert_eq!(a.len(), width * height * channels, "first image");
    assert_eq!(b.len(), width * height * channels, "second image");
    let inside = width > 2 * RADIUS && height > 2 * RADIUS;
    let margin = if border == SsimBorder::Valid && inside { RADIUS } else { 0 };
    let (mut sum, mut count) = (0.0, 0usize);
    for c in 0..channels {
        let plane = |image: &[f32]| -> Vec<f64> {
            image.iter().skip(c).step_by(channels).map(|&v| f64::from(v)).collect()
        };
        let (a, b) = (plane(a), plane(b));
        let product = |u: &[f64], v: &[f64]| -> Vec<f64> {
            let product: Vec<f64> = u.iter().zip(v).map(|(u, v)| u * v).collect();
            blur(&product, width, height)
        };
        let (mu_a, mu_b) = (blur(&a, width, height), blur(&b, width, height));
        let (aa, bb, ab) = (product(&a, &a), product(&b, &b), product(&a, &b));
        for y in margin..height - margin {
            for x in margin..width - margin {
                let i = y * width + x;
                if counted.is_some_and(|counted| !counted[i]) {
                    continue;
                }
                let (ma, mb) = (mu_a[i], mu_b[i]);
                let numerator = (2.0 * ma * mb + C1) * (2.0 * (ab[i] - ma * mb) + C2);
                let denominator =
                    (ma * ma + mb * mb + C1) * (aa[i] - ma * ma + bb[i] - mb * mb + C2);
                sum += numerator / denominator;
                count += 1;
            }
        }
    }
    if count == 0 && counted.is_none() { 1.0 } else { sum / count as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern(width: usize, height: usize) -> Vec<f32> {
        (0..width * height).map(|i| ((i * 7919) % 101) as f32 / 101.0).collect()
    }

    #[test]
    fn equal_images_score_one() {
        let a = pattern(20, 17);
        for border in [SsimBorder::Same, SsimBorder::Valid] {
            assert!((ssim(&a, &a, 20, 17, 1, border) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn constant_images_have_a_closed_form() {
        // Inside, all variances vanish and SSIM is the luminance term alone.
        let (a, b) = (vec![0.2f32; 32 * 32], vec![0.6f32; 32 * 32]);
        let expected = (2.0 * 0.2 * 0.6 + C1) / (0.04 + 0.36 + C1);
        let value = ssim(&a, &b, 32, 32, 1, SsimBorder::Valid);
        assert!((value - expected).abs() < 1e-6, "{value} {expected}");
    }

    #[test]
    fn only_counted_pixels_are_averaged() {
        let a = pattern(40, 30);
        let mut b = a.clone();
        for y in 0..30 {
            b[y * 40 + 39] = 0.0;
        }
        let far: Vec<bool> = (0..40 * 30).map(|i| i % 40 < 34).collect();
        let near: Vec<bool> = far.iter().map(|far| !far).collect();
        let of = |counted: &[bool]| ssim_of_pixels(&a, &b, 40, 30, 1, SsimBorder::Same, counted);
        assert!((of(&far) - 1.0).abs() < 1e-12, "windows that miss the last column");
        let whole = ssim(&a, &b, 40, 30, 1, SsimBorder::Same);
        let mixed = (34.0 * of(&far) + 6.0 * of(&near)) / 40.0;
        assert!((whole - mixed).abs() < 1e-12 && of(&near) < 0.99);
        assert!(of(&[false; 40 * 30]).is_nan());
    }

    #[test]
    fn matches_a_direct_two_dimensional_window() {
        let (w, h) = (15, 13);
        let a = pattern(w, h);
        let b: Vec<f32> = a.iter().map(|v| 0.8 * v + 0.05 * (v * 40.0).sin()).collect();
        let g = ssim_window();
        let (x0, y0) = (7usize, 6usize);
        let mut m = [0.0f64; 5];
        for dy in 0..11 {
            for dx in 0..11 {
                let weight = g[dx] * g[dy];
                let i = (y0 + dy - 5) * w + x0 + dx - 5;
                let (u, v) = (f64::from(a[i]), f64::from(b[i]));
                for (m, value) in m.iter_mut().zip([u, v, u * u, v * v, u * v]) {
                    *m += weight * value;
                }
            }
        }
        let direct = (2.0 * m[0] * m[1] + C1) * (2.0 * (m[4] - m[0] * m[1]) + C2)
            / ((m[0] * m[0] + m[1] * m[1] + C1) * (m[2] - m[0] * m[0] + m[3] - m[1] * m[1] + C2));
        // An 11×11 crop around the pixel has exactly one valid window: this one.
        let crop = |image: &[f32]| -> Vec<f32> {
            (1..12).flat_map(|y| image[y * w + 2..y * w + 13].to_vec()).collect()
        };
        let value = ssim(&crop(&a), &crop(&b), 11, 11, 1, SsimBorder::Valid);
        assert!((value - direct).abs() < 1e-9, "{value} {direct}");
    }
}
