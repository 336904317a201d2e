//! How bright the light is, told by highlights.
//!
//! Base color times light is all that a matte surface shows. But the coat of a dielectric reflects 4 % of the
//! light whatever its base color is: if all light is `s` times as bright as assumed, views of one point obey
//! `L = s (b D + S)` with `b` free in [0, 1]. The `s` that fits best is evidence for the scale.

use glam::Vec3;
use motes_math::median::quantile;
use rayon::prelude::*;

use super::profile::{Profile, fit_channels, linear};
use super::regions::Regions;
use crate::appearance::basis::Basis;
use crate::appearance::material::PART_SAMPLES;
use crate::appearance::{Kind, ModelOptions, ScaleEvidence};
use crate::observation::Sample;

/// Factors that are tried: 0.3 to 3.3 in steps of 10 %.
const STEPS: i32 = 12;
const STEP: f32 = 0.1;
/// Spread of the logarithm of a scene's mean base color about its typical value.
const USUAL_SPREAD: f32 = 0.35;
/// Observations and neighboring points err together; costs count this much.
const EVIDENCE: f32 = 0.1;

/// Weighs highlights of all dielectric parts against what base colors usually are.
pub(super) fn weigh_scale(
    samples: &[Sample],
    basis: &Basis,
    profile: &Profile,
    regions: &Regions,
    model: &ModelOptions,
) -> ScaleEvidence {
    let factors: Vec<f32> = (-STEPS..=STEPS).map(|k| (k as f32 * STEP).exp()).collect();
    let label_of = |p: usize| profile.labels[regions.label[regions.of_sample[p] as usize]];
    let members: Vec<usize> =
        (0..samples.len()).filter(|&p| label_of(p).kind == Kind::Dielectric).collect();
    let rows: Vec<Vec<Vec3>> = members
        .par_iter()
        .map(|&p| {
            let sample = &samples[p];
            let plain: Vec<_> = (0..sample.observations.len())
                .map(|k| linear(basis.at(p, k, label_of(p).roughness), Kind::Dielectric))
                .collect();
            factors
                .iter()
                .map(|&s| {
                    let rows: Vec<_> = plain.iter().map(|&(d, o)| (d * s, o * s)).collect();
                    fit_channels(&sample.observations, &rows).0
                })
                .collect()
        })
        .collect();
    let mut costs = vec![Vec3::ZERO; factors.len()];
    let mut counts = vec![0usize; regions.label.len()];
    members.iter().for_each(|&p| counts[regions.of_sample[p] as usize] += 1);
    for (row, &p) in rows.iter().zip(&members) {
        // What is wrong about a part is wrong for all of it: a large one is not surer than a small one.
        let count = counts[regions.of_sample[p] as usize];
        let weight = EVIDENCE * (PART_SAMPLES / count as f32).min(1.0);
        costs.iter_mut().zip(row).for_each(|(sum, cost)| *sum += *cost * weight);
    }
    // Mean log base color now; a factor s on the light divides base colors by it.
    let (mut mean, mut count) = (Vec3::ZERO, 0.0f32);
    for p in 0..samples.len() {
        let label = regions.label[regions.of_sample[p] as usize];
        let base = profile.base_color_linear[p * profile.labels.len() + label];
        mean += Vec3::from(base.max(Vec3::splat(0.01)).to_array().map(f32::ln));
        count += 1.0;
    }
    let usual =
        (mean / count.max(1.0)).element_sum() / 3.0 - model.typical_base_color.max(1e-3).ln();
    let log = |costs: &[f32]| (minimum(costs) - STEPS as f32) * STEP;

    let gray: Vec<f32> = costs.iter().map(|c| c.element_sum() / 3.0).collect();
    let log_spread = spread(&gray);
    let is_told = log_spread.is_finite();
    let own = Vec3::from([0, 1, 2].map(|c| log(&costs.iter().map(|v| v[c]).collect::<Vec<_>>())));
    ScaleEvidence {
        highlights: if is_told { log(&gray) } else { 0.0 },
        usual,
        usual_trust: model.weight_albedo_range * USUAL_SPREAD.powi(-2),
        least: brightest(samples, basis, profile, regions).ln(),
        tint: if is_told { own - own.element_sum() / 3.0 } else { Vec3::ZERO },
        log_spread,
        samples: members.len(),
    }
}

/// A scene's brightest surfaces have at most this base color: fresh snow and white paint.
const WHITEST: f32 = 0.9;
/// Share of the points that may lie above it: noise, and light that was missed.
const ABOVE: f32 = 0.03;

/// Factor on the light that takes the brightest base colors of dielectrics down to [`WHITEST`]; 0 without any.
fn brightest(samples: &[Sample], basis: &Basis, profile: &Profile, regions: &Regions) -> f32 {
    let of = |p: usize| {
        let label = profile.labels[regions.label[regions.of_sample[p] as usize]];
        if label.kind == Kind::Metal {
            return None;
        }
        // Least squares without the bound at 1.
        let (mut a, mut b) = (Vec3::splat(1e-9), Vec3::ZERO);
        for (k, o) in samples[p].observations.iter().enumerate() {
            let (slope, offset) = linear(basis.at(p, k, label.roughness), label.kind);
            a += slope * slope * o.weight;
            b += slope * (o.radiance - offset) * o.weight;
        }
        let base = (b / a).max_element();
        base.is_finite().then_some(base)
    };
    let mut all: Vec<f32> = (0..samples.len()).filter_map(of).collect();
    quantile(&mut all, 1.0 - ABOVE).map_or(0.0, |brightest| brightest.max(0.0) / WHITEST)
}

/// Position of the minimum, between the values by a parabola.
fn minimum(costs: &[f32]) -> f32 {
    let k = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
    if k == 0 || k + 1 >= costs.len() {
        return k as f32;
    }
    let (l, m, r) = (costs[k - 1], costs[k], costs[k + 1]);
    let bend = l - 2.0 * m + r;
    if bend > 0.0 { k as f32 + (0.5 * (l - r) / bend).clamp(-0.5, 0.5) } else { k as f32 }
}

fn spread(costs: &[f32]) -> f32 {
    let low = costs.iter().copied().fold(f32::INFINITY, f32::min);
    let good = costs.iter().filter(|c| **c < low + 0.5).count();
    if good == costs.len() { f32::INFINITY } else { 0.5 * good as f32 * STEP }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_minimum_between_steps_is_found() {
        let costs: Vec<f32> = (0..9).map(|k| (k as f32 - 3.3).powi(2)).collect();
        assert!((minimum(&costs) - 3.3).abs() < 1e-4);
        assert_eq!(minimum(&[0.0, 1.0]), 0.0);
        assert!(spread(&[1.0; 5]).is_infinite());
        assert!(spread(&costs) < 0.2);
    }
}
