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
    /// Nearest neighbors, in position and chromaticity, that they are drawn from.
    pub among: usize,
    /// Distance of a neighborhood, world units.
    pub radius: f32,
    /// Difference of log chromaticity at which two colors are no longer alike; infinite: all are.
    pub chroma: f32,
    /// Key of the choice.
    pub seed: u64,
}

/// Chooses pairs among points at `positions` with these colors (linear, positive).
///
/// Only near ones: far pairs of like chromaticity were tried and tie unlike things together (a beige
/// animal to a darker beige table), which costs more than the ties give.
pub(crate) fn choose_pairs(
    positions: &[Vec3],
    colors: &[Vec3],
    options: &PairOptions,
) -> Vec<Pair> {
    let chroma = colors.iter().map(|c| {
        let l = c.max(Vec3::splat(1e-4)).to_array().map(f32::ln);
        [(l[0] - l[1]) / options.chroma, (l[2] - l[1]) / options.chroma]
    });
    let features: Vec<[f32; 5]> = positions
        .iter()
        .zip(chroma)
        .map(|(p, c)| {
            let p = *p / options.radius;
            [p.x, p.y, p.z, c[0], c[1]]
        })
        .collect();
    let Ok(tree) = ImmutableKdTree::<f32, 5>::new_from_slice(&features) else {
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
