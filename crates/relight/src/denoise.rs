//! An edge-aware filter of light, deterministic: à-trous wavelets (Dammertz et al. 2010) that stop
//! at edges of the surface and at differences beyond the noise (Schied et al. 2017, the spatial
//! part).
//!
//! Per pass, over 5 x 5 pixels that lie `1, 2, 4` apart, with a B3 spline `h`:
//!
//! ```text
//! E'(p) = Σ_q h(q) w(p, q) E(q) / Σ_q h(q) w(p, q)
//! w     = (n_p · n_q)⁶⁴ exp(-|offset from the tangent plane| / (σ_x depth)) exp(-|ΔE| / (σ strength))
//! ```
//!
//! `σ` is the standard deviation of the light at `p`, which shrinks from pass to pass. Specular light has
//! the detail of the lobe: passes wider than it are left out.

use glam::Vec3;
use motes_math::luminance::luminance;
use rayon::prelude::*;

use crate::deferred::{Lit, Parts};
use crate::g_buffer::Sight;

const SPLINE: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Offset from the tangent plane that halves a weight about, as a share of the depth.
const PLANE_SHARE: f32 = 0.002;

/// Light over a grid of pixels, without the material it fell on, and what guides its filter.
pub(crate) struct Grid {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) sight: Vec<Option<Sight>>,
    pub(crate) roughness: Vec<f32>,
    /// Parts are demodulated; the variance is that of the modulated sum.
    pub(crate) lit: Vec<Lit>,
    /// Luminance of the factors.
    pub(crate) factors: Vec<[f32; 3]>,
}

pub(crate) fn luminances(parts: &Parts) -> [f32; 3] {
    [parts.diffuse, parts.specular, parts.indirect].map(luminance)
}

/// Filters in place; `strength` 0 leaves everything as it is, 1 averages differences of about one
/// standard deviation.
pub(crate) fn denoise(grid: &mut Grid, strength: f32, passes: u32) {
    if !(strength > 0.0) {
        return;
    }
    let mut variance = smooth_variance(grid);
    for pass in 0..passes {
        let levels: Vec<[f32; 3]> = grid.lit.iter().map(|lit| luminances(&lit.parts)).collect();
        let out: Vec<(Lit, f32)> = (0..grid.lit.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| filter(grid, &levels, &variance, i, pass, strength))
            .collect();
        for (i, (lit, v)) in out.into_iter().enumerate() {
            grid.lit[i] = lit;
            variance[i] = v;
        }
    }
}

/// Estimates of single pixels are noisy themselves: a 3 x 3 mean.
fn smooth_variance(grid: &Grid) -> Vec<f32> {
    let (w, h) = (grid.width, grid.height);
    let at = |i: usize| {
        let (x, y) = (i % w, i / w);
        let (mut sum, mut count) = (0.0, 0.0);
        for yy in y.saturating_sub(1)..(y + 2).min(h) {
            for xx in x.saturating_sub(1)..(x + 2).min(w) {
                if grid.sight[yy * w + xx].is_some() {
                    sum += grid.lit[yy * w + xx].variance;
                    count += 1.0;
                }
            }
        }
        sum / f32::max(count, 1.0)
    };
    (0..w * h).into_par_iter().map(at).collect()
}

/// How far a lobe of this roughness blurs, pixels: mirrors keep every detail.
fn specular_reach(roughness: f32) -> f32 {
    32.0 * roughness * roughness
}

fn filter(
    grid: &Grid,
    levels: &[[f32; 3]],
    variance: &[f32],
    i: usize,
    pass: u32,
    strength: f32,
) -> (Lit, f32) {
    let own = grid.lit[i];
    let Some(sight) = &grid.sight[i] else { return (own, variance[i]) };
    let (w, h, step) = (grid.width as i32, grid.height as i32, 1i32 << pass);
    let (x, y) = ((i % grid.width) as i32, (i / grid.width) as i32);
    let deviation = variance[i].sqrt() * strength;
    let factors = grid.factors[i];
    let here = levels[i];
    // Differences are measured as they appear: times the factor of the material.
    let scale = factors.map(|f| f / (deviation + 1e-6));
    let plane = 1.0 / (PLANE_SHARE * sight.depth * step as f32).max(1e-12);
    let narrow = (2 * step) as f32 > specular_reach(grid.roughness[i]);
    let mut sums = Parts::default();
    let (mut weights, mut squares) = ([0.0f32; 3], 0.0f32);
    for dy in -2..=2i32 {
        for dx in -2..=2i32 {
            let (xx, yy) = (x + dx * step, y + dy * step);
            if xx < 0 || yy < 0 || xx >= w || yy >= h {
                continue;
            }
            let k = (yy * w + xx) as usize;
            let Some(other) = &grid.sight[k] else { continue };
            let cosine = sight.normal.dot(other.normal);
            // Its 64th power is below the bound of weights.
            if !(cosine > 0.8) {
                continue;
            }
            let power = |v: f32| {
                let v4 = v * v * (v * v);
                let v16 = v4 * v4 * (v4 * v4);
                v16 * v16 * (v16 * v16)
            };
            let offset = (other.position - sight.position).dot(sight.normal).abs();
            let apart = offset * plane + 20.0 * (grid.roughness[k] - grid.roughness[i]).abs();
            let spline = SPLINE[dx.unsigned_abs() as usize] * SPLINE[dy.unsigned_abs() as usize];
            let geometry = spline * power(cosine) * falloff(apart);
            if !(geometry > 1e-6) {
                continue;
            }
            let lit = &grid.lit[k];
            let there = levels[k];
            let weight = |c: usize| geometry * falloff((there[c] - here[c]).abs() * scale[c]);
            let (d, n) = (weight(0), weight(2));
            let s = if narrow && k != i { 0.0 } else { weight(1) };
            sums.diffuse += lit.parts.diffuse * d;
            sums.specular += lit.parts.specular * s;
            sums.indirect += lit.parts.indirect * n;
            weights[0] += d;
            weights[1] += s;
            weights[2] += n;
            squares += d * d * variance[k];
        }
    }
    let mean = |sum: Vec3, c: usize, own: Vec3| {
        if weights[c] > 0.0 { sum / weights[c] } else { own }
    };
    let parts = Parts {
        diffuse: mean(sums.diffuse, 0, own.parts.diffuse),
        specular: mean(sums.specular, 1, own.parts.specular),
        indirect: mean(sums.indirect, 2, own.parts.indirect),
    };
    let left = if weights[0] > 0.0 { squares / (weights[0] * weights[0]) } else { variance[i] };
    (Lit { parts, ..own }, left)
}

/// `exp(-x)` to 2 %, without the call: `(1 - x / 8)⁸` cut at 0.
#[inline]
pub(crate) fn falloff(x: f32) -> f32 {
    let v = (1.0 - 0.125 * x).max(0.0);
    let v2 = v * v;
    let v4 = v2 * v2;
    v4 * v4
}
