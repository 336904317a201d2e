//! Densification and pruning: where Gaussians are missing, and which carry nothing.
//!
//! A Gaussian whose projected center is pulled hard, averaged over the views that saw it, stands
//! for several surfaces or for detail it cannot show (Kerbl et al. 2023). The number of Gaussians
//! follows a fixed budget curve (as in Taming 3DGS, Mallick et al. 2024): each round the
//! most-pulled ones are divided until the curve is met, so cost and memory are known beforehand.

use glam::{Mat3, Quat, Vec3};
use motes_math::sigmoid::{logit, sigmoid};
use motes_raster::GaussianGradients;
use motes_scene::Gaussians;
use rayon::prelude::*;

use crate::moments::Moments;

/// Gaussians per task.
const STATS_CHUNK: usize = 4096;

/// What the steps since the last refinement saw of each Gaussian.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RefineStats {
    /// Sum of the center-gradient norms.
    pub pull: Vec<f32>,
    /// Number of views that saw it.
    pub seen: Vec<u32>,
}

impl RefineStats {
    pub(crate) fn zeros(n: usize) -> Self {
        Self { pull: vec![0.0; n], seen: vec![0; n] }
    }

    /// Adds one view; the number of Gaussians it saw.
    pub(crate) fn add(&mut self, gradients: &GaussianGradients) -> u64 {
        self.pull
            .par_iter_mut()
            .zip(&mut self.seen)
            .zip(&gradients.center_norm)
            .zip(&gradients.seen)
            .with_min_len(STATS_CHUNK)
            .map(|(((pull, seen), &norm), &visible)| {
                let counts = visible && norm.is_finite();
                if counts {
                    *pull += norm;
                    *seen += 1;
                }
                u64::from(counts)
            })
            .sum()
    }

    /// Puts other scores in the place of the mean pulls.
    pub(crate) fn replace(&mut self, scores: Vec<f32>) {
        self.seen = vec![1; scores.len()];
        self.pull = scores;
    }

    fn score(&self, i: usize) -> f32 {
        self.pull[i] / self.seen[i].max(1) as f32
    }
}

/// Limits of one refinement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RefineLimits {
    /// Gaussians wanted afterwards; never exceeded.
    pub(crate) target: usize,
    /// Fainter ones go.
    pub(crate) prune_opacity: f32,
    /// Larger ones go, world units.
    pub(crate) max_scale: f32,
    /// Gaussians pulled less than this are not divided.
    pub(crate) min_pull: f32,
}

/// What a refinement did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefineCounts {
    /// Gaussians removed.
    pub pruned: usize,
    /// Gaussians divided in two.
    pub divided: usize,
}

impl RefineLimits {
    /// Whether a Gaussian is neither too faint nor too large; false for NaN.
    pub(crate) fn keeps(&self, gaussians: &Gaussians, i: usize) -> bool {
        let largest = gaussians.log_scales[i].iter().copied().fold(f32::MIN, f32::max).exp();
        sigmoid(gaussians.opacity_logits[i]) >= self.prune_opacity && largest <= self.max_scale
    }
}

/// Removes what carries nothing (and what `unneeded`, empty or one per Gaussian, says), then divides
/// the most-pulled Gaussians up to the target.
pub(crate) fn refine(
    gaussians: &mut Gaussians,
    moments: &mut Moments,
    stats: &mut RefineStats,
    limits: &RefineLimits,
    unneeded: &[bool],
) -> RefineCounts {
    let keep: Vec<u32> = (0..gaussians.len())
        .filter(|&i| limits.keeps(gaussians, i) && !unneeded.get(i).is_some_and(|u| *u))
        .map(|i| i as u32)
        .collect();
    let pruned = gaussians.len() - keep.len();

    let room = limits.target.saturating_sub(keep.len());
    let mut candidates: Vec<u32> =
        keep.iter().copied().filter(|&i| stats.score(i as usize) > limits.min_pull).collect();
    // Highest first; ties by index, so that the order is total.
    candidates.sort_by(|&a, &b| {
        stats.score(b as usize).total_cmp(&stats.score(a as usize)).then(a.cmp(&b))
    });
    candidates.truncate(room);
    candidates.sort_unstable();

    let kept = keep.len();
    let mut rows = keep;
    rows.extend(&candidates);
    let mut fresh = vec![false; rows.len()];
    fresh[kept..].fill(true);
    // Parents change too much for their old moments to mean anything.
    for (row, id) in rows[..kept].iter().enumerate() {
        fresh[row] = candidates.binary_search(id).is_ok();
    }
    let sh_row = 3 * gaussians.sh_coefficients();
    gaussians.gather(&rows);
    moments.gather(&rows, &fresh, sh_row);
    for (child, id) in candidates.iter().enumerate() {
        if let Ok(parent) = rows[..kept].binary_search(id) {
            divide(gaussians, parent, kept + child);
        }
    }
    *stats = RefineStats::zeros(gaussians.len());
    RefineCounts { pruned, divided: candidates.len() }
}

/// Distance of each half from the old center, in standard deviations of the longest axis.
const HALF_OFFSET: f32 = 0.5;
/// Standard deviation of a half along that axis: offset² + width² = 1 keeps the variance.
const HALF_WIDTH: f32 = 0.866_025_4;

/// Makes rows `a` and `b`, equal copies, the two halves of the Gaussian along its longest axis.
///
/// Mean and covariance of the pair equal those of the parent. The opacity of each half is such
/// that both together cover the middle like the parent: `1 - (1 - o')² = o`.
fn divide(gaussians: &mut Gaussians, a: usize, b: usize) {
    let s = gaussians.log_scales[a];
    let longest = (1..3).fold(0, |best, k| if s[k] > s[best] { k } else { best });
    let [w, x, y, z] = gaussians.rotations[a];
    let axes = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
    let offset = axes.col(longest) * (s[longest].exp() * HALF_OFFSET);
    let opacity = sigmoid(gaussians.opacity_logits[a]);
    let half_opacity = logit(1.0 - (1.0 - opacity).sqrt());
    for (row, sign) in [(a, -1.0), (b, 1.0)] {
        gaussians.means[row] = (Vec3::from(gaussians.means[row]) + offset * sign).to_array();
        gaussians.log_scales[row][longest] += HALF_WIDTH.ln();
        gaussians.opacity_logits[row] = half_opacity;
    }
}

pub(crate) mod relocate;
#[cfg(test)]
mod tests;
