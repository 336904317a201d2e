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

/// Spread of the scale, log units, up to which highlights count as an anchor.
pub(super) const TELLING_SPREAD: f32 = 0.35;

/// What tells of the light beside highlights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surroundings {
    /// Lamps or windows are in the scene.
    pub has_lamps: bool,
    /// Photos show the sky that lights it.
    pub has_sky: bool,
}

/// Weighs highlights of all dielectric parts against what base colors usually are.
pub(super) fn weigh_scale(
    samples: &[Sample],
    basis: &Basis,
    profile: &Profile,
    regions: &Regions,
    model: &ModelOptions,
    surroundings: Surroundings,
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
    let parts = costs_of_parts(&members, &rows, regions, factors.len());
    let costs: Vec<Vec3> =
        (0..factors.len()).map(|k| parts.iter().map(|p| p.costs[k]).sum()).collect();
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
    let gray = gray(&costs);
    let log_spread = spread(&gray);
    let is_told = log_spread.is_finite();
    let brightest = brightest(bases(samples, basis, profile, regions), surroundings.has_lamps);
    ScaleEvidence {
        highlights: if is_told { log_minimum(&gray) } else { 0.0 },
        usual,
        usual_trust: model.weight_albedo_range * USUAL_SPREAD.powi(-2),
        least: (brightest / whitest(surroundings, log_spread)).ln(),
        tint: if is_told { agreed_tint(&costs, &parts) } else { Vec3::ZERO },
        log_spread,
        samples: members.len(),
    }
}

/// What highlights of one part cost under every factor, and how much the part counts.
struct PartCosts {
    weight: f32,
    costs: Vec<Vec3>,
}

/// `rows` are costs of the samples `members` under every factor.
fn costs_of_parts(
    members: &[usize],
    rows: &[Vec<Vec3>],
    regions: &Regions,
    factors: usize,
) -> Vec<PartCosts> {
    let mut counts = vec![0usize; regions.label.len()];
    members.iter().for_each(|&p| counts[regions.of_sample[p] as usize] += 1);
    // What is wrong about a part is wrong for all of it: a large one is not surer than a small one.
    let part = |count: &usize| PartCosts {
        weight: PART_SAMPLES.min(*count as f32),
        costs: vec![Vec3::ZERO; factors],
    };
    let mut parts: Vec<PartCosts> = counts.iter().map(part).collect();
    for (row, &p) in rows.iter().zip(members) {
        let own = regions.of_sample[p] as usize;
        let share = EVIDENCE * parts[own].weight / counts[own] as f32;
        parts[own].costs.iter_mut().zip(row).for_each(|(sum, cost)| *sum += *cost * share);
    }
    parts.retain(|part| part.weight > 0.0);
    parts
}

/// What highlights say of the channels beside their common factor, per channel as far as parts agree: a metal that passes for a
/// dielectric tints its highlights, and what it says of the light no other part says.
fn agreed_tint(costs: &[Vec3], parts: &[PartCosts]) -> Vec3 {
    let told = parts.iter().filter(|part| spread(&gray(&part.costs)).is_finite());
    let tints: Vec<(f32, Vec3)> = told.map(|part| (part.weight, tint(&part.costs))).collect();
    let total: f32 = tints.iter().map(|(w, _)| w).sum();
    if !(total > 0.0) {
        return Vec3::ZERO;
    }
    let mean = tints.iter().map(|(w, t)| *w * *t).sum::<Vec3>() / total;
    let off = tints.iter().map(|(w, t)| *w * (*t - mean) * (*t - mean)).sum::<Vec3>() / total;
    let all = tint(costs);
    Vec3::from([0, 1, 2].map(|c| (all[c].abs() - off[c].sqrt()).max(0.0).copysign(all[c])))
}

/// Logarithm of the factor that explains highlights best, per channel, less its mean.
fn tint(costs: &[Vec3]) -> Vec3 {
    let own =
        Vec3::from([0, 1, 2].map(|c| log_minimum(&costs.iter().map(|v| v[c]).collect::<Vec<_>>())));
    own - own.element_sum() / 3.0
}

fn gray(costs: &[Vec3]) -> Vec<f32> {
    costs.iter().map(|c| c.element_sum() / 3.0).collect()
}

/// Logarithm of the factor of least cost.
fn log_minimum(costs: &[f32]) -> f32 {
    (minimum(costs) - STEPS as f32) * STEP
}

/// A scene's brightest surfaces have at most this base color: fresh snow and white paint.
const WHITEST: f32 = 0.9;
/// What they have at most where nothing tells the scale: few scenes have anything white (docs/benchmarks/relight.md).
const USUALLY_BELOW: f32 = 0.75;

/// Base color that hardly any of a scene is above, where highlights tell the scale to within `log_spread`.
fn whitest(surroundings: Surroundings, log_spread: f32) -> f32 {
    let Surroundings { has_lamps, has_sky } = surroundings;
    let is_told = has_lamps || has_sky || log_spread < TELLING_SPREAD;
    if is_told { WHITEST } else { USUALLY_BELOW }
}

/// Share of the points that may lie above it: noise, and light that was missed.
const ABOVE: f32 = 0.03;

/// Piece and base color of every point of a dielectric, without the bound at 1; that of the brightest channel.
fn bases(
    samples: &[Sample],
    basis: &Basis,
    profile: &Profile,
    regions: &Regions,
) -> Vec<(usize, f32)> {
    let of = |p: usize| {
        let piece = regions.of_sample[p] as usize;
        let label = profile.labels[regions.label[piece]];
        if label.kind == Kind::Metal {
            return None;
        }
        let (mut a, mut b) = (Vec3::splat(1e-9), Vec3::ZERO);
        for (k, o) in samples[p].observations.iter().enumerate() {
            let (slope, offset) = linear(basis.at(p, k, label.roughness), label.kind);
            a += slope * slope * o.weight;
            b += slope * (o.radiance - offset) * o.weight;
        }
        let base = (b / a).max_element();
        base.is_finite().then_some((piece, base))
    };
    (0..samples.len()).filter_map(of).collect()
}

/// The base color that hardly any is above; 0 without any. Beside a lamp or a window points receive light that the model has not: where
/// the scene `has_lamps`, each counts as the median of its piece.
fn brightest(mut bases: Vec<(usize, f32)>, has_lamps: bool) -> f32 {
    if has_lamps {
        bases.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        for piece in bases.chunk_by_mut(|a, b| a.0 == b.0) {
            let middle = piece[piece.len() / 2].1;
            piece.iter_mut().for_each(|point| point.1 = middle);
        }
    }
    let mut all: Vec<f32> = bases.into_iter().map(|(_, base)| base).collect();
    quantile(&mut all, 1.0 - ABOVE).unwrap_or(0.0).max(0.0)
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
    fn points_beside_a_lamp_do_not_tell_the_brightest_base_color() {
        // A gray wall of which a twentieth is lit by more than the model knows, and a white thing.
        let wall = (0..1000).map(|i| (0, if i % 20 == 0 { 2.0 } else { 0.4 }));
        let all: Vec<(usize, f32)> = wall.chain((0..100).map(|_| (1, 0.72))).collect();
        assert!((brightest(all.clone(), false) - 2.0).abs() < 1e-6);
        assert!((brightest(all, true) - 0.72).abs() < 1e-6);
        assert_eq!(brightest(Vec::new(), true), 0.0);
        // A piece that is too bright as a whole is too bright either way.
        let paper = (0..100).map(|i| (i % 2, if i % 2 == 0 { 0.3 } else { 1.8 }));
        let both = [false, true].map(|has_lamps| brightest(paper.clone().collect(), has_lamps));
        assert_eq!(both, [1.8; 2]);
    }

    #[test]
    fn white_is_expected_only_where_something_tells_the_scale() {
        let neither = Surroundings { has_lamps: false, has_sky: false };
        assert_eq!(whitest(neither, f32::INFINITY), USUALLY_BELOW);
        assert_eq!(whitest(neither, 0.1), WHITEST);
        assert_eq!(whitest(Surroundings { has_lamps: true, ..neither }, 2.0), WHITEST);
        assert_eq!(whitest(Surroundings { has_sky: true, ..neither }, 2.0), WHITEST);
    }

    #[test]
    fn a_minimum_between_steps_is_found() {
        let costs: Vec<f32> = (0..9).map(|k| (k as f32 - 3.3).powi(2)).collect();
        assert!((minimum(&costs) - 3.3).abs() < 1e-4);
        assert_eq!(minimum(&[0.0, 1.0]), 0.0);
        assert!(spread(&[1.0; 5]).is_infinite());
        assert!(spread(&costs) < 0.2);
    }

    /// Costs of a part whose highlights are explained under a light of this tint, logarithms.
    fn part(tint: Vec3, weight: f32) -> PartCosts {
        let factor = |k: i32| Vec3::splat(k as f32 * STEP);
        let costs = (-STEPS..=STEPS).map(|k| 20.0 * (factor(k) - tint) * (factor(k) - tint));
        PartCosts { weight, costs: costs.collect() }
    }

    fn tint_of(parts: &[PartCosts]) -> Vec3 {
        let at = |k| parts.iter().map(|p: &PartCosts| p.weight * p.costs[k]).sum();
        let costs: Vec<Vec3> = (0..=2 * STEPS as usize).map(at).collect();
        agreed_tint(&costs, parts)
    }

    #[test]
    fn a_tint_is_what_parts_agree_about() {
        let (warm, gold) = (Vec3::new(0.3, 0.0, -0.3), Vec3::new(0.5, 0.2, -0.7));
        let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 0.02;
        assert!(near(tint_of(&[part(warm, 100.0)]), warm));
        assert!(near(tint_of(&[part(warm, 100.0), part(warm, 30.0)]), warm));
        // One of two shows another color.
        assert!(near(tint_of(&[part(gold, 100.0), part(Vec3::ZERO, 100.0)]), Vec3::ZERO));
        let three = tint_of(&[part(warm, 100.0), part(warm, 100.0), part(gold, 100.0)]);
        assert!(three.z < -0.2 && three.z > -0.45, "{three}");
        // A part that shows no highlight says nothing.
        let flat = PartCosts { weight: 100.0, costs: vec![Vec3::ONE; 2 * STEPS as usize + 1] };
        assert!(near(tint_of(&[part(warm, 100.0), flat]), warm));
        assert_eq!(tint_of(&[]), Vec3::ZERO);
    }
}
