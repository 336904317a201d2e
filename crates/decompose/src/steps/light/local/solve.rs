//! Log factors at the anchors of a local light, from pairs of points.

use glam::Vec3;

use super::super::pairs::Pair;
use super::facings::{Facings, Weights, value};
use crate::illumination::{LocalLight, NEAR};
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

/// What the base colors of a pair differ by, less what the factors explain.
fn left(factors: &[Vec3], weights: &[Weights], log_base: &[Vec3], pair: &Pair) -> Vec3 {
    let [a, b] = [pair.a as usize, pair.b as usize];
    log_base[a] - log_base[b] - value(factors, &weights[a]) + value(factors, &weights[b])
}

fn root(left: Vec3) -> f32 {
    (left.length_squared() / 3.0 + SIGMA * SIGMA).sqrt()
}

/// Mean cost of the pairs.
pub(super) fn cost(
    factors: &[Vec3],
    weights: &[Weights],
    log_base: &[Vec3],
    pairs: &[Pair],
) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for pair in pairs {
        let root = root(left(factors, weights, log_base, pair));
        sum += f64::from(pair.weight * (root - SIGMA));
        total += f64::from(pair.weight);
    }
    sum / f64::max(total, f64::MIN_POSITIVE)
}

/// Log factors at the anchors of `start`.
pub(super) fn solve(
    start: &LocalLight,
    weights: &[Weights],
    log_base: &[Vec3],
    pairs: &[Pair],
) -> Vec<Vec3> {
    let n = start.anchors().len();
    let total: f32 = pairs.iter().map(|p| p.weight).sum::<f32>().max(f32::MIN_POSITIVE);
    let around: Vec<Weights> = start
        .anchors()
        .iter()
        .enumerate()
        .map(|(j, anchor)| {
            let near = start.weights(anchor.position, anchor.normal);
            let others: Vec<usize> = near.into_iter().map(|(k, _)| k).filter(|k| *k != j).collect();
            let share = 1.0 / others.len().clamp(1, NEAR) as f32;
            others.into_iter().map(|k| (k, share)).collect()
        })
        .collect();
    let facings = Facings::new(start, weights);
    let mut factors = vec![Vec3::ZERO; n];
    for _ in 0..ROUNDS {
        let trust: Vec<f32> = pairs
            .iter()
            .map(|pair| pair.weight / (total * root(left(&factors, weights, log_base, pair))))
            .collect();
        let mut wanted = vec![Vec3::ZERO; n];
        for (pair, trust) in pairs.iter().zip(&trust) {
            let [a, b] = [pair.a as usize, pair.b as usize];
            let pull = (log_base[a] - log_base[b]) * *trust;
            weights[a].iter().for_each(|(j, w)| wanted[*j] += pull * *w);
            weights[b].iter().for_each(|(j, w)| wanted[*j] -= pull * *w);
        }
        let apply = |l: &[Vec3]| {
            let mut out: Vec<Vec3> = l.iter().map(|v| *v * (SIZE / n as f32)).collect();
            for (pair, trust) in pairs.iter().zip(&trust) {
                let [a, b] = [&weights[pair.a as usize], &weights[pair.b as usize]];
                let pull = (value(l, a) - value(l, b)) * *trust;
                a.iter().for_each(|(j, w)| out[*j] += pull * *w);
                b.iter().for_each(|(j, w)| out[*j] -= pull * *w);
            }
            for (j, near) in around.iter().enumerate().filter(|(_, near)| !near.is_empty()) {
                let bend = (l[j] - value(l, near)) * (2.0 * CURVATURE / n as f32);
                out[j] += bend;
                near.iter().for_each(|(k, w)| out[*k] -= bend * *w);
            }
            facings.hold(l, &mut out);
            out
        };
        factors = conjugate_gradients::solve(wanted, apply, STEPS);
    }
    let bound = |v: Vec3| v.clamp(Vec3::splat(-RANGE), Vec3::splat(RANGE));
    factors.into_iter().map(bound).collect()
}
