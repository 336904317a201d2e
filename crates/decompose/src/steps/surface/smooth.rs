//! Displacement of vertices along their normals under a thin-plate energy.
//!
//! `E(u) = sum_v w_v (u_v - t_v)^2 + stiffness sum_v b_v (n_v · (mean_j y_j - y_v))^2 / h^2`,
//! `y = x + u n`, `j` the neighbors of `v`: the discrete bilaplacian (Kobbelt et al. 1998). It
//! penalizes curvature, so that noise goes first and a sphere stays. `b_v` is 1, or less where the
//! surface has a crease.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::mesh::conjugate_gradients;
use crate::mesh::{Mesh, Neighbors};

/// `n · (mean_j x_j - x)` in voxels at which a surface bends at half the stiffness: `1 / (2 R)` of a
/// radius of ten voxels.
const CREASE: f32 = 0.05;
/// Averages of it over neighbors, so that noise does not count as a crease.
const CREASE_PASSES: usize = 4;
/// Times as many averages where a mirror may be.
const WIDER: usize = 5;
/// Vertices per parallel chunk.
const CHUNK: usize = 4096;

pub(super) struct ThinPlate<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) normals: &'a [Vec3],
    pub(super) neighbors: &'a Neighbors,
    /// `w_v`; a vertex with an infinite one does not move.
    pub(super) weight: &'a [f32],
    /// `t_v`.
    pub(super) target: &'a [f32],
    pub(super) stiffness: f32,
    /// Averages over the neighbors that make the curvature which the surface is meant to have; the
    /// more, the smoother and the more thin things shrink.
    pub(super) rest_passes: usize,
    /// How far the curvature at a vertex is believed, above 0.
    pub(super) trust: &'a [f32],
    /// Where 1, the rest curvature is that of `rest_passes`; where 0, that of [`WIDER`] times as many: pits of mirrors are
    /// wider than noise.
    pub(super) steady: &'a [f32],
    /// Length of an edge, unit world.
    pub(super) voxel: f32,
}

impl ThinPlate<'_> {
    fn free(&self, v: usize) -> bool {
        self.weight[v].is_finite()
    }

    /// `n_v · (mean_j u_j n_j - u_v n_v)`; `alike` are the products `n_v · n_j`.
    #[inline]
    fn bending(&self, alike: &[f32], u: &[f32], v: usize) -> f32 {
        let ring = self.neighbors.at(v);
        if ring.is_empty() {
            return 0.0;
        }
        let pairs = ring.iter().zip(self.neighbors.row(alike, v));
        let sum: f32 = pairs.map(|(&j, alike)| u[j as usize] * alike).sum();
        sum / ring.len() as f32 - u[v]
    }

    /// The transpose of [`Self::bending`], of values whose parts per neighbor are `parts`.
    #[inline]
    fn transpose(&self, alike: &[f32], parts: &[f32], v: usize) -> f32 {
        let ring = self.neighbors.at(v);
        let pairs = ring.iter().zip(self.neighbors.row(alike, v));
        let sum: f32 = pairs.map(|(&j, alike)| parts[j as usize] * alike).sum();
        sum - parts[v] * ring.len() as f32
    }

    /// `b_v`: edges and thin things bend more easily than what is nearly flat.
    fn bending_weights(&self, rest: &[f32]) -> Vec<f32> {
        let mean = self.neighbors.smoothed(rest.to_vec(), CREASE_PASSES);
        mean.iter().map(|c| 1.0 / (1.0 + (c / (CREASE * self.voxel)).powi(2))).collect()
    }

    /// Displacements after at most `iterations` of conjugate gradients from `start`: those of weights that differ little, or zeros.
    pub(super) fn solve(&self, start: Vec<f32>, iterations: usize) -> Vec<f32> {
        let n = self.mesh.vertices.len();
        let map = |f: &(dyn Fn(usize) -> f32 + Sync)| -> Vec<f32> {
            (0..n).into_par_iter().with_min_len(CHUNK).map(f).collect()
        };
        // What bends without any displacement.
        let rest = map(&|v| {
            let ring = self.neighbors.at(v);
            if ring.is_empty() {
                return 0.0;
            }
            let x = self.mesh.vertices[v];
            let sum: Vec3 = ring.iter().map(|&j| self.mesh.vertices[j as usize] - x).sum();
            self.normals[v].dot(sum) / ring.len() as f32
        });
        let bend = self.bending_weights(&rest);
        let alike = self.neighbors.pairs(|v, j| self.normals[v].dot(self.normals[j]));
        let weighted =
            |bent: f32, v: usize| self.neighbors.part(self.stiffness * bend[v] * bent, v);
        let apply = |u: &[f32]| {
            let bent = map(&|v| weighted(self.bending(&alike, u, v), v));
            let pulled = |v: usize| self.weight[v] * u[v] + self.transpose(&alike, &bent, v);
            map(&|v| if self.free(v) { pulled(v) } else { 0.0 })
        };
        // The curvature of the surroundings is not noise: only what differs from it is pulled.
        // Normalized convolution (Knutsson & Westin 1993): what is trusted speaks for what is not.
        let passes = |sums: Vec<Vec2>, count: usize| {
            let sums = self.neighbors.smoothed(sums, count);
            map(&|v| sums[v].x / sums[v].y.max(1e-12))
        };
        let trusted = |v: usize| Vec2::new(rest[v] * self.trust[v], self.trust[v]);
        let mut common = passes((0..n).map(trusted).collect(), self.rest_passes);
        if self.steady.iter().any(|&s| s < 1.0) {
            let steady = |v: usize| self.steady[v].max(0.01);
            let wide = (0..n).map(|v| Vec2::new(common[v] * steady(v), steady(v))).collect();
            let wide = passes(wide, self.rest_passes * (WIDER - 1));
            common = map(&|v| wide[v] + (common[v] - wide[v]) * self.steady[v]);
        }
        let pulled = map(&|v| weighted(rest[v] - common[v], v));
        let residual = map(&|v| {
            if self.free(v) {
                self.weight[v] * self.target[v] - self.transpose(&alike, &pulled, v)
            } else {
                0.0
            }
        });
        conjugate_gradients::solve_from(start, residual, apply, iterations)
    }
}
