//! Pairs of points that probably have the same base color.
//!
//! Piecewise-constant reflectance, after Land & McCann 1971: points of like chromaticity, mostly near each
//! other, differ in brightness by their light rather than by their color. Single pairs are often
//! wrong (texture); a robust cost over many of them is not.

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_math::rng::keyed_rng;
use rand::RngExt;
use rayon::prelude::*;
use std::num::NonZero;

const PAIR_STREAM: u64 = 0x7061_6972;

/// Two points and how much their likeness counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// First point.
    pub a: u32,
    /// Second point.
    pub b: u32,
    /// How much it counts.
    pub weight: f32,
}

/// How pairs are chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairOptions {
    /// Per point.
    pub count: usize,
    /// Nearest neighbors that they are drawn from.
    pub among: usize,
    /// Key of the choice.
    pub seed: u64,
}

/// Distances at which two points are no longer alike.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Likeness {
    /// World units.
    pub radius: f32,
    /// Difference of log chromaticity; infinite: all are alike.
    pub chroma: f32,
}

impl Likeness {
    /// Place and color (linear, positive) of a point in units of these distances.
    pub(crate) fn feature(self, position: Vec3, color: Vec3) -> [f32; 5] {
        let p = position / self.radius;
        let l = color.max(Vec3::splat(1e-4)).to_array().map(f32::ln);
        [p.x, p.y, p.z, (l[0] - l[1]) / self.chroma, (l[2] - l[1]) / self.chroma]
    }

    /// The same with its normal, in units of `turn` (difference of unit vectors).
    pub(crate) fn facing_feature(
        self,
        position: Vec3,
        color: Vec3,
        normal: Vec3,
        turn: f32,
    ) -> [f32; 8] {
        let [x, y, z, r, b] = self.feature(position, color);
        let n = normal / turn;
        [x, y, z, r, b, n.x, n.y, n.z]
    }
}

/// Chooses pairs among points of these features, whose distance is that of a normal distribution: `exp(-d²/2)` weighs a pair.
///
/// Only near ones: far pairs of like chromaticity were tried and tie unlike things together (a beige
/// animal to a darker beige table), which costs more than the ties give.
pub(crate) fn choose_pairs<const K: usize>(
    features: &[[f32; K]],
    options: &PairOptions,
) -> Vec<Pair> {
    let Ok(tree) = ImmutableKdTree::<f32, K>::new_from_slice(features) else {
        return Vec::new();
    };
    let Some(wanted) = NonZero::new(options.among.max(1)) else {
        return Vec::new();
    };
    features
        .par_iter()
        .enumerate()
        .map(|(i, feature)| {
            let found = tree.query(feature).nearest_n::<SquaredEuclidean<f32>>(wanted).execute();
            let mut rng = keyed_rng(options.seed, PAIR_STREAM, i as u64);
            (0..options.count)
                .filter_map(|_| {
                    let other = &found[rng.random_range(0..found.len())];
                    let j = other.item as usize;
                    let weight = (-0.5 * other.distance).exp();
                    (j != i && weight > 1e-3).then_some(Pair { a: i as u32, b: j as u32, weight })
                })
                .collect::<Vec<_>>()
        })
        .flatten()
        .collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A floor, and behind it a wall, of 20 x 20 points each, 0.5 wide, with their normals.
    pub(in super::super) fn fold() -> Vec<(Vec3, Vec3)> {
        let place = |i: u32| {
            let (u, v) = ((i % 20) as f32 / 40.0, (i / 20 % 20) as f32 / 40.0);
            if i < 400 { (Vec3::new(u, v, 0.0), Vec3::Z) } else { (Vec3::new(u, 0.0, v), Vec3::Y) }
        };
        (0..800).map(place).collect()
    }

    #[test]
    fn what_faces_elsewhere_is_no_neighbor() {
        let places = fold();
        let likeness = Likeness { radius: 0.1, chroma: f32::INFINITY };
        let options = PairOptions { count: 8, among: 200, seed: 1 };
        let across = |pairs: &[Pair]| {
            let weight = |of: &dyn Fn(&&Pair) -> bool| -> f32 {
                pairs.iter().filter(of).map(|p| p.weight).sum()
            };
            weight(&|p| (p.a < 400) != (p.b < 400)) / weight(&|_| true)
        };
        let near: Vec<_> = places.iter().map(|(x, _)| likeness.feature(*x, Vec3::ONE)).collect();
        let facing: Vec<_> =
            places.iter().map(|(x, n)| likeness.facing_feature(*x, Vec3::ONE, *n, 0.5)).collect();
        let pairs = choose_pairs(&facing, &options);
        let by_normals = across(&pairs);
        let by_place = across(&choose_pairs(&near, &options));
        println!("across the fold: by place {by_place:.3}, by normals {by_normals:.4}");
        assert!(by_place > 0.05 && by_normals < 0.002, "{by_place} {by_normals}");
        assert!(pairs.len() > 800, "{} pairs", pairs.len());
    }
}
