//! Pairs of a problem's rows, with what is known of their colors.

use glam::Vec3;
use motes_math::median::median;

use super::evidence::likeness;
use super::pairs::{Likeness, Pair, PairOptions, choose_pairs};
use super::problem::{DIM, LightProblem, base_colors};
use super::solve::LitPoints;
use super::sun::{log_luminance, open_to_sun};
use crate::illumination::CellLight;
use crate::observation::{Observation, Sample};

/// Neighborhood of pairs, as a share of the distance between camera and point.
const RADIUS: f32 = 0.05;
/// Neighbors that pairs are drawn from, some with the edge of a shadow between them: a share of the points, so that more of them lie no
/// nearer to each other, and at least so many.
const AMONG_SHARE: f32 = 0.05;
const LEAST_AMONG: usize = 200;
/// Difference of log chromaticity at which base colors are no longer alike. Sun and sky differ in color, so points that look
/// alike before the light is known are mostly lit alike: choosing by looks would hide every shadow from the fit.
const CHROMA: f32 = 0.4;
/// The same for two points that the shadow of a sun divides.
const WIDE: f32 = 1.5;
/// Added to the key of such pairs.
const ACROSS_SHADOWS: u64 = 0x5ad0;
/// Neighborhood of pairs that tell of local light, as a share of the distance to the cameras: a gradient is told by what is apart.
pub(super) const LOCAL_RADIUS: f32 = 0.15;
/// Difference of their normals: what is apart and faces elsewhere is another thing, whose base color local light would explain.
pub(super) const LOCAL_TURN: f32 = 0.5;
/// Weight of pairs that are not both on a flat piece: their normals err by degrees, which flattens the light.
const UNSURE: f32 = 0.2;
/// Disagreement of the photos of a point, in logarithms, at which it counts half for local light: photos that differ do not show one
/// place of the surface, and a smooth factor would follow what they show instead.
const DISAGREEMENT: f32 = 0.15;
/// Weight of a pair of one point under two lights against a full pair.
const SAME_POINT: f32 = 4.0;

/// Difference of the normals of two points at which base colors are no longer alike: a floor is darker than the wall behind it, and light
/// from where the cameras stand, which casts no shadow that they see, would make them alike.
const TURN: f32 = 0.7;

/// Which neighbors are chosen.
struct PairKey {
    seed: u64,
    /// Share of the distance to the cameras.
    radius: f32,
    /// Difference of log chromaticity at which base colors are no longer alike.
    chroma: f32,
    /// Difference of unit normals at which base colors are no longer alike.
    turn: f32,
}

impl PairKey {
    /// Of neighbors that face one way.
    fn near(seed: u64, chroma: f32) -> Self {
        Self { seed, radius: RADIUS, chroma, turn: TURN }
    }
}

impl LightProblem<'_> {
    /// Pairs of rows near each other, of any color.
    pub(super) fn near_pairs(&self, rows: &[Vec<u32>], lit: &[LitPoints], seed: u64) -> Vec<Pair> {
        self.pairs(rows, lit, &[], PairKey::near(seed, CHROMA))
    }

    /// Pairs of rows whose base colors under these lights are alike. Pairs that the shadow of a sun divides may differ more in color, as
    /// the light of the sky does from that of the sun: under a sun that is not strong enough yet, shadows look like another material.
    pub(crate) fn pairs_under(
        &self,
        lights: &[CellLight],
        rows: &[Vec<u32>],
        lit: &[LitPoints],
        seed: u64,
    ) -> Vec<Pair> {
        let base: Vec<Vec<Vec3>> =
            lit.iter().zip(lights).map(|(l, light)| base_colors(l, light)).collect();
        let mut pairs = self.pairs(rows, lit, &base, PairKey::near(seed, CHROMA));
        let open: Vec<_> = lights.iter().zip(lit).map(|(e, lit)| open_to_sun(e, lit)).collect();
        if open.iter().any(Option::is_some) {
            let none = |lit: &LitPoints| vec![0.0; lit.radiance.len()];
            let of =
                |(open, lit): (Option<Vec<f32>>, &LitPoints)| open.unwrap_or_else(|| none(lit));
            let open: Vec<f32> = open.into_iter().zip(lit).flat_map(of).collect();
            let divided = |p: &Pair| (open[p.a as usize] - open[p.b as usize]).abs() > 0.5;
            let seed = seed.wrapping_add(ACROSS_SHADOWS);
            let wide = self.neighbors(rows, lit, &base, PairKey::near(seed, WIDE));
            pairs.extend(wide.into_iter().filter(divided));
        }
        pairs
    }

    /// Pairs of rows that tell of local light, by their base colors under the light at infinity.
    pub(super) fn local_pairs(
        &self,
        rows: &[Vec<u32>],
        lit: &[LitPoints],
        base: &[Vec<Vec3>],
        seed: u64,
    ) -> Vec<Pair> {
        let key = PairKey { seed, radius: LOCAL_RADIUS, chroma: CHROMA, turn: LOCAL_TURN };
        self.pairs(rows, lit, base, key)
    }

    /// How much every row of a single capture counts by the agreement of its photos, 0 to 1.
    pub(super) fn agreement(&self, rows: &[u32]) -> Vec<f32> {
        rows.iter().map(|&p| agreement(&self.samples[p as usize])).collect()
    }

    /// Pairs of rows whose base colors are taken to be alike.
    fn pairs(
        &self,
        rows: &[Vec<u32>],
        lit: &[LitPoints],
        base: &[Vec<Vec3>],
        key: PairKey,
    ) -> Vec<Pair> {
        let mut pairs = self.neighbors(rows, lit, base, key);
        pairs.extend(self.same_points(rows));
        pairs
    }

    /// Pairs of one point under two lights.
    fn same_points(&self, rows: &[Vec<u32>]) -> Vec<Pair> {
        let mut pairs = Vec::new();
        let mut row_of = vec![u32::MAX; self.samples.len()];
        for (row, &p) in (0..).zip(rows.iter().flatten()) {
            let other = std::mem::replace(&mut row_of[p as usize], row);
            if other != u32::MAX {
                pairs.push(Pair { a: other, b: row, weight: SAME_POINT });
            }
        }
        pairs
    }

    /// Pairs of points near each other, under one light each.
    fn neighbors(
        &self,
        rows: &[Vec<u32>],
        lit: &[LitPoints],
        base: &[Vec<Vec3>],
        key: PairKey,
    ) -> Vec<Pair> {
        let prior = self.prior_log_base.as_deref();
        let mut all = Vec::new();
        let mut start = 0;
        for (l, (rows, lit)) in rows.iter().zip(lit).enumerate() {
            let (colors, chroma) =
                base.get(l).map_or((&lit.radiance, f32::INFINITY), |base| (base, key.chroma));
            let chosen = self.chosen(rows, colors, PairKey { chroma, ..key });
            all.extend(chosen.into_iter().map(|pair| {
                let [a, b] = [pair.a, pair.b].map(|row| rows[row as usize] as usize);
                let sure = self.samples[a].sheet != 0 && self.samples[b].sheet != 0;
                let weight = self.options.weight_base_color * if sure { 1.0 } else { UNSURE };
                let shown = [pair.a, pair.b]
                    .map(|row| lit.radiance[row as usize].max(Vec3::splat(DIM)).map(f32::ln));
                let alike =
                    prior.map_or(1.0, |prior| likeness(prior[a] - prior[b], shown[0] - shown[1]));
                Pair { a: pair.a + start, b: pair.b + start, weight: weight * pair.weight * alike }
            }));
            start += rows.len() as u32;
        }
        all
    }

    /// Pairs of points of these colors, as drawn.
    fn chosen(&self, points: &[u32], colors: &[Vec3], key: PairKey) -> Vec<Pair> {
        let likeness = Likeness { radius: key.radius * self.distance, chroma: key.chroma };
        let options = PairOptions { count: 8, among: among(points.len()), seed: key.seed };
        let colored = points.iter().map(|&p| &self.samples[p as usize]).zip(colors);
        let of =
            |(s, c): (&Sample, &Vec3)| likeness.facing_feature(s.position, *c, s.normal, key.turn);
        choose_pairs(&colored.map(of).collect::<Vec<_>>(), &options)
    }
}

/// Neighbors of each of so many points that pairs are drawn from.
fn among(points: usize) -> usize {
    LEAST_AMONG.max((AMONG_SHARE * points as f32) as usize)
}

/// These pairs, each counted by the agreement of the photos of its two rows.
pub(super) fn by_agreement(pairs: &[Pair], agreement: &[f32]) -> Vec<Pair> {
    let by = |pair: &Pair| {
        let [a, b] = [pair.a, pair.b].map(|row| agreement[row as usize]);
        Pair { weight: pair.weight * a * b, ..*pair }
    };
    pairs.iter().map(by).collect()
}

/// How much a point counts by the agreement of its photos, which one light lights, 0 to 1.
fn agreement(sample: &Sample) -> f32 {
    let shown = |o: &Observation| f64::from(log_luminance(&o.radiance));
    let logs: Vec<f64> = sample.observations.iter().map(shown).collect();
    let Some(middle) = median(logs.iter().copied()) else { return 1.0 };
    let disagreement = logs.iter().map(|log| (log - middle).abs()).sum::<f64>() / logs.len() as f64;
    (1.0 + (disagreement as f32 / DISAGREEMENT).powi(2)).recip()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(radiances: &[f32]) -> Sample {
        let seen = |(photo, radiance): (u32, &f32)| Observation {
            photo,
            light: 0,
            to_viewer: Vec3::Z,
            radiance: Vec3::splat(*radiance),
            weight: 1.0,
        };
        Sample::facing_z((0..).zip(radiances).map(seen).collect())
    }

    #[test]
    fn pairs_of_more_points_reach_as_far() {
        // A square of `n` x `n` points, 1 wide.
        let reach = |n: usize| {
            let at = |i: usize| [(i % n) as f32 / n as f32, (i / n) as f32 / n as f32];
            let features: Vec<[f32; 2]> = (0..n * n).map(at).collect();
            let options = PairOptions { count: 8, among: among(n * n), seed: 3 };
            let pairs = choose_pairs(&features, &options);
            let place = |p: u32| glam::Vec2::from(at(p as usize));
            let distances = pairs.iter().map(|p| place(p.a).distance(place(p.b)));
            distances.sum::<f32>() / pairs.len() as f32
        };
        let [few, many] = [64, 128].map(reach);
        println!("{few:.4} apart of 64 x 64 points, {many:.4} of 128 x 128");
        assert!((many / few - 1.0).abs() < 0.03, "{few} {many}");
        // Of few points, all are near enough.
        assert_eq!(among(300), LEAST_AMONG);
    }

    #[test]
    fn a_point_counts_by_the_agreement_of_its_photos() {
        assert_eq!(agreement(&shown(&[0.5; 3])), 1.0);
        let half = agreement(&shown(&[-0.225, 0.0, 0.225].map(|log: f32| 0.5 * log.exp())));
        assert!((half - 0.5).abs() < 1e-4, "{half}");
        assert!(agreement(&shown(&[0.9, 0.02])) < 0.01);
        // A single photo contradicts none; black is as dark as what can be told.
        assert_eq!([&[][..], &[0.0], &[0.0, 1e-9]].map(|all| agreement(&shown(all))), [1.0; 3]);
    }
}
