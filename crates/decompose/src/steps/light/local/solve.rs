//! Log factors at the anchors of a local light, from pairs of points.

use glam::Vec3;

use super::super::pairs::Pair;
use super::facings::{Facings, Weights, value};
use crate::illumination::{LightAnchor, LocalLight, NEAR};
use crate::mesh::conjugate_gradients;

/// `λ`.
const CURVATURE: f32 = 0.05;
/// `μ`: holds what pairs do not tell.
const SIZE: f32 = 5e-3;
/// `σ` of `ρ`, as that of the light.
const SIGMA: f32 = 0.05;
/// Rounds of reweighting.
const ROUNDS: usize = 12;
/// Steps of each.
const STEPS: usize = 200;
/// Log factors stay within this: a factor of 20.
const RANGE: f32 = 3.0;

/// What a fit at the anchors of a light needs to know of the points, whatever their base colors.
pub(in crate::steps::light) struct Solver {
    /// With these anchors.
    light: LocalLight,
    /// What every point takes from them.
    weights: Vec<Weights>,
    /// The neighbors of every anchor, with their shares of the mean.
    around: Vec<Weights>,
    facings: Facings,
}

impl Solver {
    /// For points with a position, world, and a unit normal.
    pub(super) fn new(light: LocalLight, places: &[(Vec3, Vec3)]) -> Self {
        let weights: Vec<Weights> = places.iter().map(|(x, n)| light.weights(*x, *n)).collect();
        let neighbors = |(j, anchor): (usize, &LightAnchor)| -> Weights {
            let near = light.weights(anchor.position, anchor.normal);
            let others: Vec<usize> = near.into_iter().map(|(k, _)| k).filter(|k| *k != j).collect();
            let share = 1.0 / others.len().clamp(1, NEAR) as f32;
            others.into_iter().map(|k| (k, share)).collect()
        };
        let around = light.anchors().iter().enumerate().map(neighbors).collect();
        let facings = Facings::new(&light, &weights);
        Self { light, weights, around, facings }
    }

    /// The light with these log factors at its anchors.
    pub(super) fn light(&self, factors: &[Vec3]) -> LocalLight {
        self.light.with(factors)
    }

    /// What the base colors of a pair differ by, less what the factors explain.
    fn left(&self, factors: &[Vec3], log_base: &[Vec3], pair: &Pair) -> Vec3 {
        let [a, b] = [pair.a as usize, pair.b as usize];
        let explained = [a, b].map(|p| value(factors, &self.weights[p]));
        log_base[a] - log_base[b] - explained[0] + explained[1]
    }

    /// Mean cost of the pairs.
    pub(super) fn cost(&self, factors: &[Vec3], log_base: &[Vec3], pairs: &[Pair]) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for pair in pairs {
            let root = root(self.left(factors, log_base, pair));
            sum += f64::from(pair.weight * (root - SIGMA));
            total += f64::from(pair.weight);
        }
        sum / f64::max(total, f64::MIN_POSITIVE)
    }

    /// Log factors at the anchors.
    pub(super) fn solve(&self, log_base: &[Vec3], pairs: &[Pair]) -> Vec<Vec3> {
        let total: f32 = pairs.iter().map(|p| p.weight).sum::<f32>().max(f32::MIN_POSITIVE);
        let mut factors = vec![Vec3::ZERO; self.around.len()];
        for _ in 0..ROUNDS {
            let trust: Vec<f32> = pairs
                .iter()
                .map(|pair| pair.weight / (total * root(self.left(&factors, log_base, pair))))
                .collect();
            let mut wanted = vec![Vec3::ZERO; factors.len()];
            for (pair, trust) in pairs.iter().zip(&trust) {
                let [a, b] = [pair.a as usize, pair.b as usize];
                let pull = (log_base[a] - log_base[b]) * *trust;
                self.weights[a].iter().for_each(|(j, w)| wanted[*j] += pull * *w);
                self.weights[b].iter().for_each(|(j, w)| wanted[*j] -= pull * *w);
            }
            let apply = |l: &[Vec3]| self.times(l, pairs, &trust);
            factors = conjugate_gradients::solve(wanted, apply, STEPS);
        }
        let bound = |v: Vec3| v.clamp(Vec3::splat(-RANGE), Vec3::splat(RANGE));
        factors.into_iter().map(bound).collect()
    }

    /// The matrix of the least squares times `l`.
    fn times(&self, l: &[Vec3], pairs: &[Pair], trust: &[f32]) -> Vec<Vec3> {
        let n = l.len() as f32;
        let mut out: Vec<Vec3> = l.iter().map(|v| *v * (SIZE / n)).collect();
        for (pair, trust) in pairs.iter().zip(trust) {
            let [a, b] = [&self.weights[pair.a as usize], &self.weights[pair.b as usize]];
            let pull = (value(l, a) - value(l, b)) * *trust;
            a.iter().for_each(|(j, w)| out[*j] += pull * *w);
            b.iter().for_each(|(j, w)| out[*j] -= pull * *w);
        }
        for (j, near) in self.around.iter().enumerate().filter(|(_, near)| !near.is_empty()) {
            let bend = (l[j] - value(l, near)) * (2.0 * CURVATURE / n);
            out[j] += bend;
            near.iter().for_each(|(k, w)| out[*k] -= bend * *w);
        }
        self.facings.hold(l, &mut out);
        out
    }
}

fn root(left: Vec3) -> f32 {
    (left.length_squared() / 3.0 + SIGMA * SIGMA).sqrt()
}
