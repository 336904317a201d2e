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
