//! Masks of views to Gaussians, in closed form.
//!
//! A Gaussian's share is the part of its contribution that lies inside the masks. FlashSplat (Shen et al.
//! 2024) takes the larger label after adding a bias; the bias that is right differs from scene to scene.
//! Here it is measured: the threshold whose selection renders most like the masks.

use motes_scene::Selection;
use rayon::prelude::*;

use crate::index::SceneIndex;

/// Thresholds that are tried.
const THRESHOLDS: [f32; 13] =
    [0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8];

/// What masks say about Gaussians.
#[derive(Clone, Debug)]
pub(crate) struct Lifted {
    /// Confidence per Gaussian; 0 where no view shows it.
    pub(crate) selection: Selection,
    /// The threshold on the share inside.
    pub(crate) threshold: f32,
    /// Intersection over union of the rendered selection and the masks.
    pub(crate) agreement: f32,
}

/// Lifts masks (`[nodes]`, 0 to 1).
pub(crate) fn lift_masks(index: &SceneIndex, mask: &[f32]) -> Lifted {
    let shares = index.lift(mask);
    let both_and_either = agreements(index, &shares, mask);
    let (mut threshold, mut agreement, mut best) = (0.5, 0.0, f32::NEG_INFINITY);
    for (t, [both, either]) in THRESHOLDS.into_iter().zip(both_and_either) {
        let iou = if either > 0.0 { (both / either) as f32 } else { 0.0 };
        // Ties and near ties go to the middle.
        let merit = iou - 1e-3 * (t - 0.5).abs();
        if merit > best {
            (threshold, agreement, best) = (t, iou, merit);
        }
    }
    // Nothing is mostly inside: what is most inside.
    let most = shares.iter().copied().filter(|s| *s >= 0.0).fold(0.0, f32::max);
    if most > 0.0 && most < threshold {
        threshold = 0.8 * most;
    }
    let confidence = shares.iter().map(|&share| remapped(share, threshold)).collect();
    Lifted { selection: Selection { confidence }, threshold, agreement }
}

/// A share as a confidence: the threshold becomes one half.
pub(crate) fn remapped(share: f32, threshold: f32) -> f32 {
    if !(share >= 0.0) {
        return 0.0;
    }
    let half = Selection::THRESHOLD;
    match share >= threshold {
        true => half + (1.0 - half) * ((share - threshold) / (1.0 - threshold)).min(1.0),
        false => (half * share / threshold).min(half.next_down()),
    }
}

/// Soft intersection and union, by area, of the masks and the rendered selection at each threshold.
fn agreements(index: &SceneIndex, shares: &[f32], mask: &[f32]) -> [[f64; 2]; THRESHOLDS.len()] {
    // How many thresholds a Gaussian passes: it is selected at all of the first ones.
    let passed: Vec<u8> =
        shares.iter().map(|s| THRESHOLDS.iter().take_while(|&&t| *s >= t).count() as u8).collect();
    let of_view = |v: usize| {
        let view = &index.views[v];
        let mut sums = [[0.0f64; 2]; THRESHOLDS.len()];
        for (s, (segment, node)) in view.segments.iter().zip(index.range(v)).enumerate() {
            let (mut at, mut all) = ([0.0f32; THRESHOLDS.len() + 1], 0.0f32);
            for (i, w) in view.votes.of(s) {
                at[usize::from(passed[i as usize])] += w;
                all += w;
            }
            let (mut inside, m, area) = (0.0f32, mask[node], f64::from(segment.area_px));
            for k in (0..THRESHOLDS.len()).rev() {
                inside += at[k + 1];
                let rendered = if all > 0.0 { inside / all } else { 0.0 };
                sums[k][0] += area * f64::from(rendered.min(m));
                sums[k][1] += area * f64::from(rendered.max(m));
            }
        }
        sums
    };
    let views: Vec<[[f64; 2]; THRESHOLDS.len()]> =
        (0..index.views.len()).into_par_iter().map(of_view).collect();
    let mut total = [[0.0; 2]; THRESHOLDS.len()];
    for sums in views {
        for (total, sum) in total.iter_mut().zip(sums) {
            *total = [total[0] + sum[0], total[1] + sum[1]];
        }
    }
    total
}
