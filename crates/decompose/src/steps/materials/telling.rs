//! What speaks for a metal, and for a sharp highlight.
//!
//! A metal shows what is around it: from elsewhere it shows something else. Paint, wood and cloth belong to their place, whoever
//! looks. With `x_pk` the logarithm of what photo `k` shows of point `p`, less the photo's own gain:
//!
//! ```text
//! share = mean_p var_k x_pk / var_p median_k x_pk
//! ```
//!
//! Errors of surface and light are sharp, too, and a label that is free to mirror anything explains some of them; this share does not
//! depend on light, normals or roughness.

use motes_math::median::median;

use super::profile::{Label, Profile};
use super::regions::Regions;
use crate::appearance::Kind;
use crate::observation::Sample;
use crate::observation::samples::luminance;

/// Share from which a part may be a rough metal (docs/benchmarks/decompose.md).
const LEAST_SHARE: f32 = 0.25;
/// Roughness from which a metal needs that evidence: what is sharper shows a picture of its surroundings, which a fit does not invent.
const ROUGH: f32 = 0.45;
/// Share from which a part of a plane may be a metal of any roughness: the far rim of a plane is seen at grazing angles only, where every
/// coat reflects as much.
const LEAST_SHARE_OF_PLANE: f32 = 0.5;
/// Least roughness of a highlight that the generic coat of a dielectric has.
const SHARP: f32 = 0.3;
/// Share of the cost of a part without highlights that a sharper one must save.
const LEAST_SHARP_GAIN: f32 = 0.2;
/// Linear photo value below which ratios are noise.
const BLACK: f32 = 0.01;
/// Photos that a point must be seen in.
const LEAST_PHOTOS: usize = 3;

/// What photos show of the points, log luminance less the photo's own gain.
pub(super) struct Shown {
    /// Of every point that enough photos see: variance over the photos, and the median.
    spread: Vec<Option<[f64; 2]>>,
    /// Of every point: photos, in rising order, each with what it shows over the point's mean.
    changes: Vec<ByPhoto>,
}

/// A value per photo, by its index, in rising order.
type ByPhoto = Vec<(usize, f64)>;

impl Shown {
    pub(super) fn of(samples: &[Sample]) -> Self {
        let log = |radiance| f64::from((luminance(radiance).max(0.0) + BLACK).ln());
        let of = |s: &Sample| -> ByPhoto {
            let observed = s.observations.iter();
            let mut logs: ByPhoto = observed.map(|o| (o.photo as usize, log(o.radiance))).collect();
            logs.sort_by_key(|(photo, _)| *photo);
            logs
        };
        let logs: Vec<ByPhoto> = samples.iter().map(of).collect();
        let gains = gains(&logs);
        let changes = |values: &ByPhoto| -> ByPhoto {
            let x = values.iter().map(|&(k, v)| (k, v - gains[k]));
            let mean = x.clone().map(|(_, v)| v).sum::<f64>() / values.len().max(1) as f64;
            x.map(|(k, v)| (k, v - mean)).collect()
        };
        let changes: Vec<ByPhoto> = logs.iter().map(changes).collect();
        let spread = |(values, changes): (&ByPhoto, &ByPhoto)| {
            let variance = changes.iter().map(|(_, v)| v * v).sum::<f64>() / changes.len() as f64;
            let middle = median(values.iter().map(|&(k, v)| v - gains[k]))?;
            (values.len() >= LEAST_PHOTOS).then_some([variance, middle])
        };
        Self { spread: logs.iter().zip(&changes).map(spread).collect(), changes }
    }

    /// How much of what is seen of some points moves with the viewer, over what stays at its place; 0 of points nobody sees.
    pub(super) fn moving_share(&self, points: &[usize]) -> f32 {
        let members: Vec<[f64; 2]> = points.iter().filter_map(|&p| self.spread[p]).collect();
        let n = members.len().max(1) as f64;
        let moving = members.iter().map(|m| m[0]).sum::<f64>() / n;
        let mean = members.iter().map(|m| m[1]).sum::<f64>() / n;
        let lasting = members.iter().map(|m| (m[1] - mean).powi(2)).sum::<f64>() / n;
        if moving > 0.0 { (moving / lasting.max(1e-12)) as f32 } else { 0.0 }
    }

    /// Correlation of what the photos of two points show over their means, over pairs of points and photos of both; 0 of none.
    pub(super) fn coherence(&self, pairs: impl Iterator<Item = (usize, usize)>) -> f64 {
        let (mut product, mut squares) = (0.0, [0.0; 2]);
        for (p, q) in pairs.filter(|(p, q)| p != q) {
            for (photo, a) in &self.changes[p] {
                if let Ok(k) = self.changes[q].binary_search_by_key(photo, |(photo, _)| *photo) {
                    let b = self.changes[q][k].1;
                    product += a * b;
                    squares = [squares[0] + a * a, squares[1] + b * b];
                }
            }
        }
        product / (squares[0] * squares[1]).sqrt().max(1e-30)
    }

    /// Points of parts that are called a metal without moving like one.
    pub(super) fn doubtful_metals(
        &self,
        samples: &[Sample],
        profile: &Profile,
        regions: &Regions,
        roughness: &[f32],
    ) -> Vec<bool> {
        let is_doubtful: Vec<bool> = regions
            .label
            .iter()
            .enumerate()
            .map(|(part, &label)| {
                let Label { kind, roughness: r } = profile.labels[label];
                if kind != Kind::Metal {
                    return false;
                }
                let members = regions.members(part);
                let least = match members.first() {
                    Some(&p) if samples[p].sheet != 0 => LEAST_SHARE_OF_PLANE,
                    _ if roughness[r] >= ROUGH => LEAST_SHARE,
                    _ => 0.0,
                };
                self.moving_share(&members) < least
            })
            .collect();
        (0..samples.len()).map(|p| is_doubtful[regions.of_sample[p] as usize]).collect()
    }
}

/// Median over the points of how far each photo lies above what others show of them; 0 of a photo that shows none.
fn gains(logs: &[ByPhoto]) -> Vec<f64> {
    let photos = logs.iter().flatten().map(|(k, _)| k + 1).max().unwrap_or(0);
    let mut over: Vec<Vec<f64>> = vec![Vec::new(); photos];
    for values in logs.iter().filter(|v| v.len() >= LEAST_PHOTOS) {
        let middle = median(values.iter().map(|(_, v)| *v)).unwrap_or(0.0);
        values.iter().for_each(|(k, v)| over[*k].push(v - middle));
    }
    over.into_iter().map(|v| median(v).unwrap_or(0.0)).collect()
}

/// Takes sharp highlights from parts that hardly need them: a mirror in the wrong place is worse than none.
pub(super) fn without_weak_highlights(profile: &Profile, regions: &mut Regions, roughness: &[f32]) {
    let is_sharp = |l: &Label| l.kind == Kind::Dielectric && roughness[l.roughness] < SHARP;
    let Some(matte) = profile.labels.iter().position(|l| l.kind == Kind::Matte) else { return };
    for (label, costs) in regions.label.iter_mut().zip(&regions.costs) {
        let saved = 1.0 - costs[*label] / costs[matte].max(f32::MIN_POSITIVE);
        if !is_sharp(&profile.labels[*label]) || saved >= LEAST_SHARP_GAIN {
            continue;
        }
        let allowed = (0..costs.len())
            .filter(|&l| profile.labels[l].kind != Kind::Metal && !is_sharp(&profile.labels[l]));
        let priced = |l: usize| costs[l] + profile.prices[l];
        let best = allowed.min_by(|&a, &b| priced(a).total_cmp(&priced(b)));
        *label = best.unwrap_or(matte);
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::profile::labels;
    use super::*;
    use crate::observation::Observation;

    /// Points whose base colors differ by `paint` (log), and that show `mirrored` (log) of what is around them.
    fn points(paint: f32, mirrored: f32, gain: f32) -> Vec<Sample> {
        (0..80)
            .map(|p: u32| {
                let observations = (0..12u32)
                    .map(|k| {
                        let place = paint * (1.9 * p as f32).sin();
                        let moving = mirrored * (0.7 * (p + 3 * k) as f32).sin();
                        Observation {
                            photo: k,
                            light: 0,
                            to_viewer: Vec3::Z,
                            radiance: Vec3::splat((place + moving + gain * (k % 3) as f32).exp()),
                            weight: 1.0,
                        }
                    })
                    .collect();
                Sample::facing_z(observations)
            })
            .collect()
    }

    fn share(paint: f32, mirrored: f32, gain: f32) -> f32 {
        let samples = points(paint, mirrored, gain);
        Shown::of(&samples).moving_share(&(0..samples.len()).collect::<Vec<_>>())
    }

    /// Whether a metal of this roughness is doubted where about a third of what lasts moves.
    fn is_doubted(sheet: u32, roughness: f32) -> bool {
        let on_sheet = |sample| Sample { sheet, ..sample };
        let samples: Vec<Sample> = points(0.5, 0.3, 0.0).into_iter().map(on_sheet).collect();
        let labels = labels(1);
        let metal = labels.iter().position(|l| l.kind == Kind::Metal).expect("a metal");
        let (costs, base_color_linear) = (vec![0.0; 240], vec![Vec3::ONE; 240]);
        let profile = Profile { prices: vec![0.0; 3], costs, base_color_linear, labels };
        let regions =
            Regions { of_sample: vec![0; 80], label: vec![metal], costs: vec![vec![0.0; 3]] };
        let doubted =
            Shown::of(&samples).doubtful_metals(&samples, &profile, &regions, &[roughness]);
        doubted[0]
    }

    #[test]
    fn what_belongs_to_its_place_is_no_metal() {
        assert!(share(0.5, 0.1, 0.0) < LEAST_SHARE);
        assert!(share(0.1, 0.5, 0.0) > 4.0 * LEAST_SHARE);
    }

    #[test]
    fn a_metal_plane_has_to_move_more_than_other_metals() {
        let third = share(0.5, 0.3, 0.0);
        assert!(third > LEAST_SHARE && third < LEAST_SHARE_OF_PLANE, "{third}");
        assert!(is_doubted(1, 0.1) && is_doubted(1, 0.6));
        assert!(!is_doubted(0, 0.1) && !is_doubted(0, 0.6));
    }

    #[test]
    fn exposure_of_the_photos_is_not_taken_for_reflection() {
        let [without, with] = [0.0, 0.4].map(|gain| share(0.5, 0.1, gain));
        assert!(with < LEAST_SHARE && (with - without).abs() < 0.05, "{without} {with}");
    }

    #[test]
    fn a_part_that_nobody_sees_moves_nothing() {
        let unseen = vec![Sample::facing_z(Vec::new()); 3];
        assert_eq!(Shown::of(&unseen).moving_share(&[0, 1, 2]), 0.0);
        assert_eq!(Shown::of(&unseen).coherence([(0, 1)].into_iter()), 0.0);
        assert_eq!(Shown::of(&[]).moving_share(&[]), 0.0);
    }
}
