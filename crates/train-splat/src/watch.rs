//! Whether a fit shows more than no fit at all would.
//!
//! A photo whose every pixel is its mean color, and a photo blurred until it is eight pixels wide,
//! know nothing of the scene. A fit that predicts photos worse than these has failed, whatever its
//! loss did.

use serde::{Deserialize, Serialize};

use crate::target::Target;

/// Pixels of the long side of a blurred photo.
const CELLS: usize = 8;
/// A run of fewer steps is not judged: it was meant to stop early.
pub const SHORTEST_RUN: u32 = 100;
/// A run of at least so many steps must beat blurred photos, a shorter one photos of one color.
pub const LONG_RUN: u32 = 500;
/// Mean PSNR of photos of one color, dB, above which there is nothing to see in them.
const BLANK_DB: f64 = 45.0;
/// Spread of the rendered opacity over the pixels of photos with an outline, below which it is flat.
const FLAT_ALPHA: f64 = 0.1;

/// What pictures without shape reach on a set of photos, means over the photos.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// PSNR of the mean color of each photo, dB.
    pub constant: f64,
    /// PSNR of each photo blurred until eight pixels are left of its long side, dB.
    pub blurred: f64,
}

impl Baseline {
    /// Of one photo over `background`.
    pub fn of(target: &Target, background: [f32; 3]) -> Self {
        let (w, h) = (target.width, target.height);
        let cell = w.max(h).div_ceil(CELLS).max(1);
        let (columns, rows) = (w.div_ceil(cell), h.div_ceil(cell));
        let (mut constant, mut blurred, mut count) = (0.0, 0.0, 0.0);
        for (c, &behind) in background.iter().enumerate() {
            let mut value = vec![0.0f64; w * h];
            let (mut sums, mut counts) = (vec![0.0; columns * rows], vec![0.0; columns * rows]);
            for y in 0..h {
                for (x, &v) in target.row(c, y).iter().enumerate() {
                    let at = y * w + x;
                    if target.weight.as_ref().is_some_and(|m| m[at] == 0) {
                        value[at] = f64::NAN;
                        continue;
                    }
                    let a = target.alpha.as_ref().map_or(1.0, |a| f64::from(a[at]) / 255.0);
                    value[at] = a * f64::from(v) / 255.0 + (1.0 - a) * f64::from(behind);
                    let i = y / cell * columns + x / cell;
                    sums[i] += value[at];
                    counts[i] += 1.0;
                }
            }
            let whole: f64 = counts.iter().sum();
            let mean = sums.iter().sum::<f64>() / whole.max(1.0);
            let cells: Vec<f64> = sums
                .iter()
                .zip(&counts)
                .map(|(sum, count)| if *count > 0.0 { sum / count } else { mean })
                .collect();
            for (at, &v) in value.iter().enumerate().filter(|(_, v)| v.is_finite()) {
                let smooth = interpolated(&cells, columns, rows, cell, at % w, at / w);
                constant += (v - mean).powi(2);
                blurred += (v - smooth).powi(2);
                count += 1.0;
            }
        }
        let psnr = |sum: f64| -10.0 * (sum / f64::max(count, 1.0)).max(1e-12).log10();
        Self { constant: psnr(constant), blurred: psnr(blurred) }
    }

    /// Mean over photos.
    pub fn mean(all: &[Self]) -> Self {
        let n = all.len().max(1) as f64;
        let sum = |of: fn(&Self) -> f64| all.iter().map(of).sum::<f64>() / n;
        Self { constant: sum(|b| b.constant), blurred: sum(|b| b.blurred) }
    }

    /// The PSNR that a run of so many steps must reach, dB; `None` when it is too short to judge.
    pub fn needed(&self, steps: u32) -> Option<f64> {
        match steps {
            LONG_RUN.. => Some(self.blurred),
            SHORTEST_RUN.. => Some(self.constant),
            _ => None,
        }
    }

    /// Whether the photos show one color each.
    pub fn is_blank(&self) -> bool {
        self.constant > BLANK_DB
    }
}

/// Bilinear interpolation between the centers of cells.
fn interpolated(
    cells: &[f64],
    columns: usize,
    rows: usize,
    cell: usize,
    x: usize,
    y: usize,
) -> f64 {
    let place = |v: usize, count: usize| {
        let at = ((v as f64 + 0.5) / cell as f64 - 0.5).clamp(0.0, count as f64 - 1.0);
        let low = at as usize;
        (low, (low + 1).min(count - 1), at - low as f64)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (place(x, columns), place(y, rows));
    let row = |y: usize| cells[y * columns + x0] * (1.0 - fx) + cells[y * columns + x1] * fx;
    row(y0) * (1.0 - fy) + row(y1) * fy
}

/// How a fit does on a few training photos.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// Mean PSNR of the fit, dB.
    pub psnr: f64,
    /// What pictures without shape reach there.
    pub baseline: Baseline,
    /// Standard deviation of the rendered opacity over pixels, where photos have an outline.
    pub alpha_spread: Option<f64>,
}

/// Why a fit is not what was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Failure {
    /// There is no Gaussian left.
    Empty,
    /// The photos show one color each.
    BlankPhotos,
    /// The rendered opacity is the same everywhere, where the photos have an outline.
    FlatAlpha,
    /// Pictures without shape predict the photos better.
    BelowBaseline {
        /// PSNR of the fit, dB.
        psnr: f64,
        /// What it had to reach, dB.
        needed: f64,
    },
}

impl Health {
    /// What is wrong with a fit of `gaussians` after a run that is to take `steps`.
    pub fn failure(&self, gaussians: usize, steps: u32) -> Option<Failure> {
        let needed = self.baseline.needed(steps)?;
        if gaussians == 0 {
            return Some(Failure::Empty);
        }
        if self.baseline.is_blank() {
            return Some(Failure::BlankPhotos);
        }
        if self.alpha_spread.is_some_and(|spread| spread < FLAT_ALPHA) {
            return Some(Failure::FlatAlpha);
        }
        (self.psnr < needed).then_some(Failure::BelowBaseline { psnr: self.psnr, needed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(value: impl Fn(usize, usize) -> u8) -> Target {
        let (width, height) = (64, 48);
        let plane: Vec<u8> = (0..width * height).map(|i| value(i % width, i / width)).collect();
        Target { width, height, rgb: plane.repeat(3), weight: None, alpha: None }
    }

    #[test]
    fn blur_keeps_what_is_wide_and_loses_what_is_fine() {
        let ramp = Baseline::of(&target(|x, _| 4 * x as u8), [0.0; 3]);
        assert!(ramp.blurred > ramp.constant + 15.0, "{ramp:?}");
        let checks = Baseline::of(&target(|x, y| if (x + y) % 2 == 0 { 0 } else { 200 }), [0.0; 3]);
        assert!((checks.blurred - checks.constant).abs() < 0.01, "{checks:?}");
        assert!(Baseline::of(&target(|_, _| 77), [0.0; 3]).is_blank() && !checks.is_blank());
    }

    #[test]
    fn a_short_run_is_judged_less_and_a_shorter_one_not_at_all() {
        let baseline = Baseline { constant: 12.0, blurred: 17.0 };
        let health = Health { psnr: 15.0, baseline, alpha_spread: None };
        assert_eq!(health.failure(9, 20), None);
        assert_eq!(health.failure(9, 200), None);
        let below = Failure::BelowBaseline { psnr: 15.0, needed: 17.0 };
        assert_eq!(health.failure(9, 1500), Some(below));
        assert_eq!(health.failure(0, 1500), Some(Failure::Empty));
        let flat = Health { psnr: 30.0, alpha_spread: Some(0.01), ..health };
        assert_eq!(flat.failure(9, 1500), Some(Failure::FlatAlpha));
    }
}
