//! One ratio per Gaussian from the votes of all views, of which some may be wrong.
//!
//! Alternating, a few rounds:
//!
//! ```text
//! r_i = robust mean over views of (r_iv - g_v), weights c_iv ω_v       weighted median, then Cauchy IRLS
//! g_v = weighted median over Gaussians of (r_iv - r_i), per channel      gains; their median over views is 0
//! d_v = weighted median of |r_iv - g_v - r_i|,   ω_v = 1 / (1 + (d_v / 3 s)²)²,   s = median of d_v
//! ```

use motes_math::median::weighted_median;
use rayon::prelude::*;

use super::Agreement;
use super::votes::Votes;

const ROUNDS: usize = 5;
/// Log ratios that differ by less are alike: a fifth of a stop.
const SCALE: f32 = 0.14;
/// Least scale of disagreement between views: what splats differ from photos by.
const LEAST_DEVIATION: f32 = 0.03;
/// A view looks at this many Gaussians at most to find its gain.
const PROBES: usize = 20_000;

/// Of one view.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfView {
    /// Log, per channel.
    pub(super) gain: [f32; 3],
    /// Natural log.
    pub(super) deviation: f32,
    pub(super) weight: f32,
}

pub(super) struct Consensus {
    /// Log ratio per Gaussian.
    pub(super) ratio: Vec<[f32; 3]>,
    pub(super) views: Vec<OfView>,
    pub(super) unseen: usize,
}

pub(super) fn consensus(votes: &[Votes], agreement: Agreement, gaussians: usize) -> Consensus {
    let mut views = vec![OfView { gain: [0.0; 3], deviation: 0.0, weight: 1.0 }; votes.len()];
    let robust = agreement == Agreement::Robust;
    let mut ratio = vote(votes, &views, robust, gaussians);
    for _ in 0..if robust { ROUNDS } else { 0 } {
        judge(votes, &ratio, &mut views, true);
        ratio = vote(votes, &views, true, gaussians);
    }
    if !robust {
        // Said, but of no effect.
        judge(votes, &ratio, &mut views, false);
    }
    let typical: Vec<([f32; 3], f32)> = ratio.iter().flatten().map(|(r, w)| (*r, *w)).collect();
    let fill = [0, 1, 2].map(|c| median(typical.iter().map(|(r, w)| (r[c], *w)).collect()));
    let unseen = ratio.iter().filter(|r| r.is_none()).count();
    let ratio = ratio.into_iter().map(|r| r.map_or(fill, |(r, _)| r)).collect();
    Consensus { ratio, views, unseen }
}

type Voted = Vec<Option<([f32; 3], f32)>>;

fn vote(votes: &[Votes], views: &[OfView], robust: bool, gaussians: usize) -> Voted {
    (0..gaussians)
        .into_par_iter()
        .map(|i| {
            let heard: Vec<([f32; 3], f32)> = votes
                .iter()
                .zip(views)
                .filter(|(v, _)| v.weight[i] > 0.0)
                .map(|(v, of)| {
                    let r = v.ratio[i];
                    let g = of.gain;
                    ([r[0] - g[0], r[1] - g[1], r[2] - g[2]], v.weight[i] * of.weight)
                })
                .collect();
            let total: f32 = heard.iter().map(|(_, w)| w).sum();
            if !(total > 0.0) {
                return None;
            }
            let channel = |c: usize| {
                let values: Vec<(f32, f32)> = heard.iter().map(|(r, w)| (r[c], *w)).collect();
                if robust { robust_mean(values) } else { mean(&values, |_| 1.0) }
            };
            Some(([0, 1, 2].map(channel), total))
        })
        .collect()
}

fn judge(votes: &[Votes], ratio: &Voted, views: &mut [OfView], act: bool) {
    let probe = ratio.len().div_ceil(PROBES).max(1);
    let residuals = |v: &Votes, c: usize| -> Vec<(f32, f32)> {
        (0..ratio.len())
            .step_by(probe)
            .filter(|i| v.weight[*i] > 0.0)
            .filter_map(|i| ratio[i].map(|(r, _)| (v.ratio[i][c] - r[c], v.weight[i])))
            .collect()
    };
    let found: Vec<([f32; 3], f32)> = votes
        .par_iter()
        .map(|v| {
            let all = [0, 1, 2].map(|c| residuals(v, c));
            let gain = [0, 1, 2].map(|c| median(all[c].clone()));
            let off = all
                .iter()
                .zip(gain)
                .flat_map(|(values, g)| values.iter().map(move |(r, w)| ((r - g).abs(), *w)));
            (gain, median(off.collect()))
        })
        .collect();
    let center = [0, 1, 2].map(|c| median(found.iter().map(|(g, _)| (g[c], 1.0)).collect()));
    let spread = median(found.iter().map(|(_, d)| (*d, 1.0)).collect()).max(LEAST_DEVIATION);
    for (view, (gain, deviation)) in views.iter_mut().zip(found) {
        view.gain = [0, 1, 2].map(|c| gain[c] - center[c]);
        view.deviation = deviation;
        if act {
            view.weight = (1.0 + (deviation / (3.0 * spread)).powi(2)).powi(-2);
        }
    }
}

/// Weighted median, then a few steps of Cauchy weights around it.
fn robust_mean(values: Vec<(f32, f32)>) -> f32 {
    let mut center = median(values.clone());
    for _ in 0..4 {
        center = mean(&values, |v| 1.0 / (1.0 + ((v - center) / SCALE).powi(2)));
    }
    center
}

fn mean(values: &[(f32, f32)], by: impl Fn(f32) -> f32) -> f32 {
    let (mut sum, mut weights) = (0.0f64, 0.0f64);
    for (v, w) in values {
        let w = f64::from(w * by(*v));
        sum += w * f64::from(*v);
        weights += w;
    }
    if weights > 0.0 { (sum / weights) as f32 } else { 0.0 }
}

/// Weighted median; 0 of nothing.
fn median(values: Vec<(f32, f32)>) -> f32 {
    weighted_median(values).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight views of 100 Gaussians whose true ratio is their number in percent; two views are spoiled.
    fn votes() -> Vec<Votes> {
        let of = |view: usize| {
            let ratio = (0..100).map(|i| {
                let noise = 0.02 * (((i * 37 + view * 11) % 17) as f32 / 8.5 - 1.0);
                let r = 0.01 * i as f32 + noise;
                match view {
                    3 => [r + 0.7, r + 0.7, r + 0.7],
                    5 => [((i * 7919) % 100) as f32 * 0.03 - 1.5; 3],
                    _ => [r; 3],
                }
            });
            Votes { ratio: ratio.collect(), weight: vec![1.0; 100] }
        };
        (0..8).map(of).collect()
    }

    #[test]
    fn a_majority_wins_over_a_bright_view_and_garbage() {
        let error = |agreement| {
            let found = consensus(&votes(), agreement, 100);
            let off = |(i, r): (usize, &[f32; 3])| (r[0] - 0.01 * i as f32).abs();
            found.ratio.iter().enumerate().map(off).fold(0.0, f32::max)
        };
        assert!(error(Agreement::Robust) < 0.03, "{}", error(Agreement::Robust));
        assert!(error(Agreement::Mean) > 0.1);
        let found = consensus(&votes(), Agreement::Robust, 100);
        assert!((found.views[3].gain[0] - 0.7).abs() < 0.03, "{:?}", found.views[3]);
        assert!(found.views[3].weight > 0.8, "a gain is not a disagreement");
        assert!(found.views[5].weight < 0.05 && found.views[0].weight > 0.8);
    }

    #[test]
    fn a_gaussian_that_only_a_bright_view_saw_is_corrected() {
        let mut votes = votes();
        (0..8).filter(|v| *v != 3).for_each(|v| votes[v].weight[50] = 0.0);
        (0..8).for_each(|v| votes[v].weight[70] = 0.0);
        let found = consensus(&votes, Agreement::Robust, 100);
        assert!((found.ratio[50][0] - 0.5).abs() < 0.05, "{:?}", found.ratio[50]);
        assert_eq!(found.unseen, 1);
        assert!((0.3..0.7).contains(&found.ratio[70][0]), "the median of all");
        let nothing = consensus(&[], Agreement::Robust, 2);
        assert_eq!((nothing.ratio, nothing.unseen), (vec![[0.0; 3]; 2], 2));
    }
}
