//! The response curve of a camera (Debevec & Malik 1997, "Recovering High Dynamic Range Radiance Maps from Photographs").
//!
//! A pixel of irradiance `E` exposed for `t` has the value `Z = f(E t)`; `g = ln f⁻¹`. For samples `i` and pictures `j` minimize
//!
//! ```text
//! Σ_ij (w(Z_ij) (g(Z_ij) - ln E_i - ln t_j))² + λ Σ_z (w(z) g''(z))²,   g(128) = 0
//! ```
//!
//! `ln E_i` stands in its own samples only, so it is eliminated (Schur complement), and 256 unknowns are left, solved by Cholesky's
//! method in f64. Samples that contradict the first solution (what moved) are left out of the second.

use super::{BracketError, Exposed, check, hat, reference};

/// λ of the smoothness, per sample. Pictures two stops apart tie only every other value to the next: less leaves waves.
const SMOOTHNESS: f64 = 5.0;
/// Samples per step of brightness, of 32 steps.
const SAMPLES_PER_STEP: usize = 12;
const STEPS: usize = 32;
/// A sample that is off by more than this in ln E, root mean square, moved; stricter as the curve gets better.
const MOVED: [f64; 3] = [0.3, 0.15, 0.1];
/// Least weight of a smoothness term, so that the ends are no free parameters.
const LEAST_WEIGHT: f64 = 0.003;

/// How exposure follows from values.
#[derive(Clone, Debug, PartialEq)]
pub enum Response {
    /// Values are proportional to exposure.
    Linear,
    /// `g(z) = ln(E t)` of the 8-bit values of each channel; `g(128) = 0`.
    Curve(Box<[[f64; 256]; 3]>),
}

impl Response {
    /// The response of the camera that took a series; values are quantized to 8 bits.
    ///
    /// # Errors
    /// The pictures are no series, or too little of them is well exposed twice.
    pub fn find(series: &[Exposed]) -> Result<Self, BracketError> {
        check(series)?;
        let samples = samples(series);
        let mut curves = Box::new([[0.0; 256]; 3]);
        for (c, curve) in curves.iter_mut().enumerate() {
            let rows: Vec<Vec<(usize, f64)>> =
                samples.iter().map(|pixel| values(series, *pixel, c)).collect();
            *curve = solve(&rows).ok_or(BracketError::NoOverlap)?;
            for limit in MOVED {
                let is_still = |row: &&Vec<(usize, f64)>| spread(row, curve) < limit;
                let still: Vec<_> = rows.iter().filter(is_still).cloned().collect();
                *curve = solve(&still).unwrap_or(*curve);
            }
            // A camera gives more for more light: what noise turned around is leveled.
            for z in 1..256 {
                curve[z] = curve[z].max(curve[z - 1]);
            }
        }
        Ok(Self::Curve(curves))
    }

    /// `ln(E t)` of a value from 0 to 1, up to a constant; a linear value of 0 is far below all others.
    pub fn log_exposure(&self, channel: usize, value: f32) -> f64 {
        match self {
            Self::Linear => f64::from(value.max(1e-6)).ln(),
            Self::Curve(curves) => {
                let at = f64::from(value.clamp(0.0, 1.0)) * 255.0;
                let low = (at as usize).min(254);
                let curve = &curves[channel];
                curve[low] + (curve[low + 1] - curve[low]) * (at - low as f64)
            }
        }
    }
}

/// Pixels that cover the brightnesses of the reference, the smoothest of each step.
fn samples(series: &[Exposed]) -> Vec<usize> {
    let image = &series[reference(series)].image;
    let (w, h) = (image.width, image.height);
    let gray = |x: usize, y: usize| image.pixel(x, y).iter().take(3).sum::<f32>() / 3.0;
    // A stride keeps the work of large pictures bounded.
    let stride = (w * h / 200_000).max(1);
    let mut steps: Vec<Vec<(f32, usize)>> = vec![Vec::new(); STEPS];
    for i in (0..w * h).step_by(stride) {
        let (x, y) = (i % w, i / w);
        let around = [
            (x.max(1) - 1, y),
            ((x + 1).min(w - 1), y),
            (x, y.max(1) - 1),
            (x, (y + 1).min(h - 1)),
        ];
        let at = gray(x, y);
        let rough = around.iter().map(|(x, y)| (gray(*x, *y) - at).abs()).fold(0.0, f32::max);
        steps[((at.clamp(0.0, 1.0) * STEPS as f32) as usize).min(STEPS - 1)].push((rough, i));
    }
    let smoothest = |mut step: Vec<(f32, usize)>| {
        step.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // Of the smoother half, spread over the picture.
        let half = step.len().div_ceil(2);
        step.truncate(half.max(SAMPLES_PER_STEP));
        let stride = (step.len() / SAMPLES_PER_STEP).max(1);
        step.into_iter().step_by(stride).map(|(_, i)| i).take(SAMPLES_PER_STEP)
    };
    steps.into_iter().flat_map(smoothest).collect()
}

/// 8-bit value and `ln t` of a pixel in every picture.
fn values(series: &[Exposed], pixel: usize, channel: usize) -> Vec<(usize, f64)> {
    let value = |e: &Exposed| {
        let v = e.image.data[pixel * e.image.channels + channel];
        ((v.clamp(0.0, 1.0) * 255.0).round() as usize, e.stops * std::f64::consts::LN_2)
    };
    series.iter().map(value).collect()
}

fn weight(z: usize) -> f64 {
    f64::from(hat(z as f32 / 255.0))
}

/// Root mean square of what a sample says about its `ln E`, weighted.
fn spread(row: &[(usize, f64)], curve: &[f64; 256]) -> f64 {
    let (mut sum, mut squares, mut total) = (0.0, 0.0, 0.0);
    for (z, log_time) in row {
        let (w, e) = (weight(*z), curve[*z] - log_time);
        sum += w * e;
        squares += w * e * e;
        total += w;
    }
    if total > 0.0 { (squares / total - (sum / total).powi(2)).max(0.0).sqrt() } else { 0.0 }
}

/// The curve of one channel; `None` where no sample is well exposed twice.
fn solve(rows: &[Vec<(usize, f64)>]) -> Option<[f64; 256]> {
    let n = 256;
    let (mut a, mut b) = (vec![0.0; n * n], vec![0.0; n]);
    let mut useful = 0;
    for row in rows {
        let squares: Vec<f64> = row.iter().map(|(z, _)| weight(*z).powi(2)).collect();
        let total: f64 = squares.iter().sum();
        if !(total > 0.0) {
            continue;
        }
        useful += usize::from(squares.iter().filter(|s| **s > 0.01).count() >= 2);
        let mean_time = row.iter().zip(&squares).map(|((_, t), s)| s * t).sum::<f64>() / total;
        for ((z, t), s) in row.iter().zip(&squares) {
            a[z * n + z] += s;
            b[*z] += s * (t - mean_time);
            for ((z2, _), s2) in row.iter().zip(&squares) {
                a[z * n + z2] -= s * s2 / total;
            }
        }
    }
    if useful < 8 {
        return None;
    }
    let lambda = SMOOTHNESS * rows.len() as f64;
    for z in 1..n - 1 {
        let w = lambda * weight(z).max(LEAST_WEIGHT).powi(2);
        for (i, di) in [(z - 1, 1.0), (z, -2.0), (z + 1, 1.0)] {
            for (k, dk) in [(z - 1, 1.0), (z, -2.0), (z + 1, 1.0)] {
                a[i * n + k] += w * di * dk;
            }
        }
    }
    a[128 * n + 128] += rows.len() as f64;
    let x = cholesky(a, b)?;
    let gauge = x[128];
    Some(std::array::from_fn(|z| x[z] - gauge))
}

/// The solution of a symmetric positive definite system.
fn cholesky(mut a: Vec<f64>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for i in 0..n {
        for k in 0..=i {
            let dot: f64 = (0..k).map(|m| a[i * n + m] * a[k * n + m]).sum();
            let v = a[i * n + k] - dot;
            if i == k {
                if !(v > 1e-12) {
                    return None;
                }
                a[i * n + i] = v.sqrt();
            } else {
                a[i * n + k] = v / a[k * n + k];
            }
        }
    }
    for i in 0..n {
        let dot: f64 = (0..i).map(|m| a[i * n + m] * b[m]).sum();
        b[i] = (b[i] - dot) / a[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|m| a[m * n + i] * b[m]).sum();
        b[i] = (b[i] - dot) / a[i * n + i];
    }
    Some(b)
}
