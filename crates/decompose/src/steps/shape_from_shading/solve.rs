//! Displacements under which neighbors have one base color.
//!
//! `E(u) = Σ_pq w ρ(|β_p - β_q|) + λ Σ (L u)² + μ Σ u²`, `β = ln L - ln E(n)` per channel, the logarithm of a base color: what
//! photos show over what a vertex receives with its normal; `n` turns with the displacements `u` along the normals to first order, `ρ` the
//! cost of Geman & McClure (1987), so that edges of texture do not count, `L` the mean of the neighbors less the vertex.

use glam::Vec3;
use rayon::prelude::*;

use super::turns::Rows;
use crate::mesh::Neighbors;
use crate::mesh::conjugate_gradients;

const CHUNK: usize = 1024;
/// Times that pairs are weighed.
const ROUNDS: usize = 6;
const ITERATIONS: usize = 120;
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
    /// Cost and weight of a pair by the square of its difference over that of `sigma`.
    fn pair(x2: f32) -> (f32, f32) {
        (x2 / (1.0 + x2), (1.0 + x2).powi(-2))
    }

    /// Weights of the pairs by their differences, those of a vertex in the order of its neighbors, and the mean cost of pairs.
    fn pairs(&self, told: &Told<'_>, u: &[f32]) -> (Vec<Vec<f32>>, f64) {
        let beta = map(u.len(), |v| told.log_base[v].map(|b| b + told.change(u, v)));
        let rows = map(u.len(), |p| {
            let mut cost = (0.0f64, 0.0f64);
            let of = |&q: &u32| {
                let q = q as usize;
                let (Some(a), Some(b)) = (beta[p], beta[q]) else { return 0.0 };
                let base = told.weight[p] * told.weight[q];
                let (value, w) = Self::pair((a - b).length_squared() / self.weights.sigma.powi(2));
                cost = (cost.0 + f64::from(base * value), cost.1 + f64::from(base));
                base * w
            };
            let row: Vec<f32> = self.neighbors.at(p).iter().map(of).collect();
            (row, cost)
        });
        let (sum, n) = rows.iter().fold((0.0, 0.0), |(s, n), (_, c)| (s + c.0, n + c.1));
        (rows.into_iter().map(|(row, _)| row).collect(), if n > 0.0 { sum / n } else { 0.0 })
    }

    /// Weights of the pairs, less beside edges of texture.
    fn weigh(&self, told: &Told<'_>, u: &[f32]) -> Vec<Vec<f32>> {
        let rows = self.pairs(told, u).0;
        let sharp =
            |row: &Vec<f32>| (row.iter().sum::<f32>() / row.len().max(1) as f32).powi(BESIDE_EDGES);
        let clear: Vec<f32> = rows.iter().map(sharp).collect();
        map(u.len(), |p| {
            let ring = rows[p].iter().zip(self.neighbors.at(p));
            ring.map(|(w, &q)| w * clear[p] * clear[q as usize]).collect()
        })
    }

    /// Mean cost of the pairs, 0 to 1.
    pub(super) fn cost(&self, u: &[f32]) -> f64 {
        let all: f64 = self.told.iter().map(|t| self.pairs(t, u).1).sum();
        all / self.told.len().max(1) as f64
    }

    /// `Σ_q w_pq (x_p - x_q)`.
    fn differences(&self, weights: &[Vec<f32>], x: &[Vec3]) -> Vec<Vec3> {
        map(x.len(), |p| {
            let ring = self.neighbors.at(p).iter().zip(&weights[p]);
            ring.map(|(&q, w)| (x[p] - x[q as usize]) * *w).sum()
        })
    }

    /// Half the gradient of what does not depend on the photos, at displacements `u`.
    fn stiff(&self, u: &[f32]) -> Vec<f32> {
        let free = |v: usize| self.free[v];
        let bent = map(u.len(), |v| if free(v) { self.neighbors.laplacian(u, v) } else { 0.0 });
        map(u.len(), |v| {
            let unbent = self.neighbors.laplacian_transposed(&bent, v);
            if free(v) { u[v] * self.weights.hold + unbent * self.weights.bending } else { 0.0 }
        })
    }

    /// The displacements, edges.
    pub(super) fn solve(&self) -> Vec<f32> {
        let n = self.start.len();
        let columns: Vec<Rows<Vec3>> =
            self.told.iter().map(|t| t.by_displacement.transposed()).collect();
        let known: Vec<Vec<Vec3>> = self
            .told
            .iter()
            .map(|t| t.log_base.iter().map(|b| b.unwrap_or(Vec3::ZERO)).collect())
            .collect();
        let resting = self.stiff(self.start);
        let mut step = vec![0.0f32; n];
        for _ in 0..ROUNDS {
            let weights: Vec<Vec<Vec<f32>>> =
                self.told.iter().map(|t| self.weigh(t, &step)).collect();
            // Adds half the gradient of the pairs whose logarithms are `x`.
            let add_pull = |to: &mut [f32], l: usize, x: &[Vec3]| {
                let pulled = self.differences(&weights[l], x);
                let back = |v: usize| -> f32 {
                    columns[l].at(v).iter().map(|(p, c)| c.dot(pulled[*p as usize])).sum()
                };
                let add = map(n, |v| if self.free[v] { back(v) } else { 0.0 });
                to.iter_mut().zip(add).for_each(|(to, a)| *to += a);
            };
            let apply = |u: &[f32]| -> Vec<f32> {
                let mut out = self.stiff(u);
                for (l, told) in self.told.iter().enumerate() {
                    add_pull(&mut out, l, &map(n, |v| told.change(u, v)));
                }
                out
            };
            let mut slope = resting.clone();
            known.iter().enumerate().for_each(|(l, known)| add_pull(&mut slope, l, known));
            let right = slope.iter().map(|s| -s).collect();
            step = conjugate_gradients::solve(right, apply, ITERATIONS);
        }
        step
    }
}
