//! Displacements under which neighbors have one base color.
//!
//! `E(u) = Σ_pq w ρ(|β_p - β_q|) + λ Σ (L u)² + μ Σ u²`, `β = ln L - ln E(n)` per channel, the logarithm of a base color: what
//! photos show over what a vertex receives with its normal; `n` turns with the displacements `u` along the normals to first order, `ρ` the
//! cost of Geman & McClure (1987), so that edges of texture do not count, `L` the mean of the neighbors less the vertex.

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::turns::Rows;
use crate::mesh::Neighbors;
use crate::mesh::conjugate_gradients;

const CHUNK: usize = 1024;
/// Times that pairs are weighed.
const ROUNDS: usize = 6;
const ITERATIONS: usize = 16;
/// Power of the mean weight around a vertex: photos mix colors there, which looks like a slope.
const BESIDE_EDGES: i32 = 2;

/// Weights and scales.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    /// Difference of logarithms, over all channels, at which a pair counts a quarter.
    pub sigma: f32,
    /// `λ`, displacements in edges.
    pub bending: f32,
    /// `μ`.
    pub hold: f32,
}

/// What one light tells.
pub(super) struct Told<'a> {
    /// `β` with the normals as they are; none where photos do not tell.
    pub log_base: Vec<Option<Vec3>>,
    /// Change of `β`, per channel, by the displacements.
    pub by_displacement: Rows<Vec3>,
    /// How far a vertex counts, 0 to 1.
    pub weight: &'a [f32],
}

pub(super) struct Displacement<'a> {
    pub told: &'a [Told<'a>],
    pub neighbors: &'a Neighbors,
    pub free: &'a [bool],
    /// Displacements before, edges.
    pub start: &'a [f32],
    pub weights: Weights,
}

fn map<T: Send>(count: usize, of: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    (0..count).into_par_iter().with_min_len(CHUNK).map(of).collect()
}

impl Told<'_> {
    /// Change of `β` by displacements.
    fn change(&self, u: &[f32], v: usize) -> Vec3 {
        self.by_displacement.at(v).iter().map(|&(j, c)| c * u[j as usize]).sum()
    }
}

impl Displacement<'_> {
    /// Base weight, and the square of the difference over that of `sigma`, of a pair; no weight where photos do not tell.
    fn pair(&self, told: &Told<'_>, beta: &[Option<Vec3>], p: usize, q: usize) -> (f32, f32) {
        let (Some(a), Some(b)) = (beta[p], beta[q]) else { return (0.0, 0.0) };
        let x2 = (a - b).length_squared() / self.weights.sigma.powi(2);
        (told.weight[p] * told.weight[q], x2)
    }

    fn beta(told: &Told<'_>, u: &[f32]) -> Vec<Option<Vec3>> {
        map(u.len(), |v| told.log_base[v].map(|b| b + told.change(u, v)))
    }

    /// Weights of the pairs by their differences, less beside edges of texture.
    fn weigh(&self, told: &Told<'_>, u: &[f32]) -> Vec<f32> {
        let beta = Self::beta(told, u);
        let weights = self.neighbors.pairs(|p, q| {
            let (base, x2) = self.pair(told, &beta, p, q);
            base * (1.0 + x2).powi(-2)
        });
        let clear = map(u.len(), |v| {
            let row = self.neighbors.row(&weights, v);
            (row.iter().sum::<f32>() / row.len().max(1) as f32).powi(BESIDE_EDGES)
        });
        let less = self.neighbors.pairs(|p, q| clear[p] * clear[q]);
        weights.into_iter().zip(less).map(|(w, less)| w * less).collect()
    }

    /// Mean cost of the pairs, 0 to 1.
    pub(super) fn cost(&self, u: &[f32]) -> f64 {
        let of = |told: &Told<'_>| -> f64 {
            let beta = Self::beta(told, u);
            let costs = map(u.len(), |p| {
                self.neighbors.at(p).iter().fold((0.0f64, 0.0f64), |(sum, count), &q| {
                    let (base, x2) = self.pair(told, &beta, p, q as usize);
                    (sum + f64::from(base * x2 / (1.0 + x2)), count + f64::from(base))
                })
            });
            let (sum, count) = costs.iter().fold((0.0, 0.0), |(s, n), c| (s + c.0, n + c.1));
            if count > 0.0 { sum / count } else { 0.0 }
        };
        self.told.iter().map(of).sum::<f64>() / self.told.len().max(1) as f64
    }

    /// `Σ_q w_pq (x_p - x_q)`.
    fn differences(&self, weights: &[f32], x: &[Vec3A]) -> Vec<Vec3A> {
        map(x.len(), |p| {
            let ring = self.neighbors.at(p).iter().zip(self.neighbors.row(weights, p));
            ring.map(|(&q, w)| (x[p] - x[q as usize]) * *w).sum()
        })
    }

    /// Half the gradient of what does not depend on the photos, at displacements `u`.
    fn stiff(&self, u: &[f32]) -> Vec<f32> {
        let free = |v: usize| self.free[v];
        let bent = |v: usize| {
            if free(v) { self.neighbors.part(self.neighbors.laplacian(u, v), v) } else { 0.0 }
        };
        let bent = map(u.len(), bent);
        map(u.len(), |v| {
            let unbent = self.neighbors.laplacian_transposed(&bent, v);
            if free(v) { u[v] * self.weights.hold + unbent * self.weights.bending } else { 0.0 }
        })
    }

    /// Diagonal of half the second derivative, without the products of slopes of different vertices.
    fn diagonal(&self, columns: &[Rows<Vec3>], weights: &[Vec<f32>]) -> Vec<f32> {
        let of = |v: usize| {
            if !self.free[v] {
                return 0.0;
            }
            let part = |j: &u32| self.neighbors.part(1.0f32, *j as usize).powi(2);
            let bent = 1.0 + self.neighbors.at(v).iter().map(part).sum::<f32>();
            let pull = |(columns, weights): (&Rows<Vec3>, &Vec<f32>)| -> f32 {
                let row = |p: u32| self.neighbors.row(weights, p as usize).iter().sum::<f32>();
                columns.at(v).iter().map(|&(p, c)| row(p) * c.length_squared()).sum()
            };
            let pulls: f32 = columns.iter().zip(weights).map(pull).sum();
            self.weights.hold + self.weights.bending * bent + pulls
        };
        map(self.free.len(), of)
    }

    /// The displacements, edges.
    pub(super) fn solve(&self) -> Vec<f32> {
        let n = self.start.len();
        let columns: Vec<Rows<Vec3>> =
            self.told.iter().map(|t| t.by_displacement.transposed()).collect();
        let known: Vec<Vec<Vec3A>> = self
            .told
            .iter()
            .map(|t| t.log_base.iter().map(|b| b.unwrap_or(Vec3::ZERO).into()).collect())
            .collect();
        let resting = self.stiff(self.start);
        let mut step = vec![0.0f32; n];
        for _ in 0..ROUNDS {
            let weights: Vec<Vec<f32>> = self.told.iter().map(|t| self.weigh(t, &step)).collect();
            // Adds half the gradient of the pairs whose logarithms are `x`.
            let add_pull = |to: &mut [f32], l: usize, x: &[Vec3A]| {
                let pulled = self.differences(&weights[l], x);
                let back = |v: usize| -> f32 {
                    columns[l].at(v).iter().map(|(p, c)| c.dot(pulled[*p as usize].into())).sum()
                };
                let add = map(n, |v| if self.free[v] { back(v) } else { 0.0 });
                to.iter_mut().zip(add).for_each(|(to, a)| *to += a);
            };
            let apply = |u: &[f32]| -> Vec<f32> {
                let mut out = self.stiff(u);
                for (l, told) in self.told.iter().enumerate() {
                    add_pull(&mut out, l, &map(n, |v| told.change(u, v).into()));
                }
                out
            };
            let mut slope = resting.clone();
            known.iter().enumerate().for_each(|(l, known)| add_pull(&mut slope, l, known));
            let right = slope.iter().map(|s| -s).collect();
            let diagonal = self.diagonal(&columns, &weights);
            step = conjugate_gradients::solve_scaled(right, &diagonal, apply, ITERATIONS);
        }
        step
    }
}
