//! Metals that no label explains.
//!
//! A fit tells a metal by what it mirrors. Gaussians dig pits into what mirrors, and under wrong normals every label fails alike. Signs that
//! need no normals are left: a point and its neighbors are explained much worse than the scene is, most of what they show moves with the
//! viewer, and it moves alike at points that lie side by side. Leaves, fur and misplaced texture move, too, but every point on its own.

use std::collections::{BTreeMap, BTreeSet};

use motes_math::knn::nearest_neighbors;
use motes_math::median::median;

use super::coat::is_coated;
use super::find::{NARROW, metal_color};
use super::profile::Profile;
use super::regions::Claim;
use super::telling::Shown;
use crate::appearance::basis::Basis;
use crate::observation::Sample;
use crate::observation::samples::luminance;

/// Points that are judged together, and those of them whose changes are compared with a point's own.
const TOGETHER: usize = 40;
const BESIDE: usize = 8;
/// Least misfit of such a neighborhood, and over the median of the scene.
const LEAST_MISFIT: f64 = 1.5;
const WORSE: f64 = 2.5;
/// Least share of it that moves with the viewer, over what stays at its place: where a mirror begins, and where it goes on.
const LEAST_SHARE: [f32; 2] = [0.4, 0.25];
/// Least correlation of changes side by side, the same.
const LEAST_COHERENCE: [f64; 2] = [0.2, 0.1];
/// Least correlation over all of a thing: some neighborhoods of leaves reach the first.
const LEAST_COHERENCE_OF_ALL: f64 = 0.23;
/// Least mean number of photos that show a point.
const LEAST_VIEWS: f64 = 5.0;
/// Points that a mirror begins at from which it is a thing.
const LEAST_POINTS: usize = 20;
/// Least luminance of its base color as a metal. A dark coat moves with the viewer, too, and reflects a twenty-fifth.
const LEAST_REFLECTANCE: f32 = 0.25;

/// Claims of metal for the points of things that mirror although no label explains them (docs/benchmarks/decompose.md), together with the
/// metal parts among their points, as `metal_part` numbers them. Whether there are any.
pub(super) fn claim(
    samples: &[Sample],
    profile: &Profile,
    shown: &Shown,
    basis: &Basis,
    metal_part: &dyn Fn(usize) -> Option<u32>,
    claims: &mut [Claim],
) -> bool {
    let positions: Vec<[f32; 3]> = samples.iter().map(|s| s.position.to_array()).collect();
    let around = nearest_neighbors(&positions, TOGETHER);
    let around =
        |p: usize, count: usize| around[p * TOGETHER..][..count].iter().map(|q| *q as usize);
    let signs = signs(samples, profile, shown, &around);
    let of_sample = things(&signs, &|p| around(p, BESIDE));
    let mut things: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (p, &thing) in of_sample.iter().enumerate().filter(|(_, thing)| **thing != NO_THING) {
        things.entry(thing).or_default().push(p);
    }
    things.retain(|&thing, points| {
        let roughest = basis.roughness.len() - 1;
        let color = || metal_color(basis, samples, &of_sample, thing as usize, roughest);
        let begins = points.iter().filter(|&&p| signs[p] == Signs::Clear).count();
        begins >= LEAST_POINTS
            && luminance(color()) >= LEAST_REFLECTANCE
            && !is_coated(samples, basis, points, NARROW.min(roughest))
            && coherence(points, shown, &around) >= LEAST_COHERENCE_OF_ALL
    });
    // A fit may call half of a thing metal, and parts may reach beyond the signs, which end where photos are few.
    let known: BTreeSet<u32> = things.values().flatten().filter_map(|&p| metal_part(p)).collect();
    let of_known =
        (0..samples.len()).filter(|&p| metal_part(p).is_some_and(|k| known.contains(&k)));
    things.values().flatten().copied().chain(of_known).for_each(|p| claims[p] = Claim::Metal);
    !things.is_empty()
}

/// Number of what is no thing.
const NO_THING: u32 = u32::MAX;

/// How clearly a point mirrors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Signs {
    None,
    /// Only beside what clearly does.
    Faint,
    Clear,
}

/// Numbers of what hangs together and clearly mirrors somewhere (hysteresis, Canny 1986).
fn things<I: Iterator<Item = usize>>(signs: &[Signs], around: &impl Fn(usize) -> I) -> Vec<u32> {
    let mut thing = vec![NO_THING; signs.len()];
    let mut next = 0;
    for start in 0..signs.len() {
        if signs[start] != Signs::Clear || thing[start] != NO_THING {
            continue;
        }
        let mut open = vec![start];
        thing[start] = next;
        while let Some(p) = open.pop() {
            for q in around(p).filter(|&q| signs[q] != Signs::None) {
                if thing[q] == NO_THING {
                    thing[q] = next;
                    open.push(q);
                }
            }
        }
        next += 1;
    }
    thing
}

/// How clearly points mirror, as the neighborhood of each says.
fn signs<I: Iterator<Item = usize>>(
    samples: &[Sample],
    profile: &Profile,
    shown: &Shown,
    around: &impl Fn(usize, usize) -> I,
) -> Vec<Signs> {
    let misfit: Vec<f64> =
        (0..samples.len()).map(|p| f64::from(profile.misfit_of(p, &samples[p]))).collect();
    let usual = median(misfit.iter().copied()).unwrap_or(0.0);
    let of = |p: usize| {
        let near: Vec<usize> = std::iter::once(p).chain(around(p, TOGETHER)).collect();
        let mean = |of: &dyn Fn(usize) -> f64| {
            near.iter().map(|&q| of(q)).sum::<f64>() / near.len() as f64
        };
        if mean(&|q| misfit[q]) < LEAST_MISFIT.max(WORSE * usual)
            || mean(&|q| samples[q].observations.len() as f64) < LEAST_VIEWS
        {
            return Signs::None;
        }
        let share = shown.moving_share(&near);
        let coherence = coherence(&near, shown, around);
        let exceeds = |k: usize| share >= LEAST_SHARE[k] && coherence >= LEAST_COHERENCE[k];
        match (exceeds(0), exceeds(1)) {
            (true, _) => Signs::Clear,
            (_, true) => Signs::Faint,
            _ => Signs::None,
        }
    };
    (0..samples.len()).map(of).collect()
}

/// How far points and their neighbors change alike from photo to photo.
fn coherence<I: Iterator<Item = usize>>(
    points: &[usize],
    shown: &Shown,
    around: &impl Fn(usize, usize) -> I,
) -> f64 {
    shown.coherence(points.iter().flat_map(|&q| around(q, BESIDE).map(move |r| (q, r))))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::appearance::basis::Terms;
    use crate::observation::Observation;

    const PHOTOS: u32 = 10;

    /// Points of a square of 8 by 8 that show `shown(point, photo)`, beside as many that are gray whoever looks, and how many of the square
    /// are claimed. The first `known` are of one metal already. No label explains what changes from photo to photo: the light is even,
    /// and brings 1.
    fn claimed(shown: impl Fn(u32, u32) -> f32, known: usize) -> [usize; 2] {
        let samples: Vec<Sample> = (0..192)
            .map(|p: u32| {
                let radiance = |k| if p < 64 { shown(p, k) } else { 0.3 };
                let observe = |k| Observation {
                    photo: k,
                    light: 0,
                    to_viewer: Vec3::Z,
                    radiance: Vec3::splat(radiance(k)),
                    weight: 1.0,
                };
                let sample = Sample::facing_z((0..PHOTOS).map(observe).collect());
                let place = Vec3::new((p % 8) as f32, (p / 8) as f32, 0.0);
                Sample { position: place + if p < 64 { 0.0 } else { 50.0 } * Vec3::X, ..sample }
            })
            .collect();
        let terms = Terms { diffuse: Vec3::ONE, metal_slope: Vec3::ONE, ..Terms::default() };
        let basis = Basis {
            roughness: vec![0.3],
            terms: vec![terms; 192 * PHOTOS as usize],
            first: (0..=192).map(|p| p * PHOTOS as usize).collect(),
        };
        let profile = Profile::new(&samples, &basis, &|_| 0.0);
        let mut claims = vec![Claim::None; 192];
        let shown = Shown::of(&samples);
        let metal_part = |p: usize| (p < known).then_some(3);
        let any = claim(&samples, &profile, &shown, &basis, &metal_part, &mut claims);
        let count = |range: std::ops::Range<usize>| {
            claims[range].iter().filter(|c| **c == Claim::Metal).count()
        };
        assert_eq!(any, count(0..192) > 0);
        [count(0..64), count(64..192)]
    }

    /// What a mirror shows: a bright thing wanders over it.
    fn wanders(p: u32, k: u32) -> f32 {
        0.5 + 0.45 * (0.5 * (p % 8) as f32 + 1.3 * k as f32).sin()
    }

    #[test]
    fn what_wanders_over_neighbors_and_no_label_explains_is_metal() {
        assert_eq!(claimed(wanders, 0), [64, 0]);
        assert_eq!(claimed(wanders, 40), [64, 0], "what is known in part is one thing");
        assert_eq!(claimed(wanders, 70), [64, 6], "what is known reaches beyond the signs");
    }

    #[test]
    fn leaves_dark_coats_paint_and_what_few_photos_show_are_none() {
        let leaves =
            |p: u32, k: u32| 0.5 + 0.45 * (1.7 * (p * p + 7 * k * (p % 5 + 1)) as f32).sin();
        assert_eq!(claimed(leaves, 0), [0, 0]);
        assert_eq!(claimed(|p, k| 0.1 * wanders(p, k), 0), [0, 0]);
        assert_eq!(claimed(|p, _| wanders(p, 3), 70), [0, 0]);
    }
}
