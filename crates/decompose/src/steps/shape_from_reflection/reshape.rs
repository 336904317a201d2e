//! Moves vertices so that the surface has given normals.
//!
//! `E(u) = Σ_edges (m · (x_i + u_i - x_j - u_j))² + Σ hold |u|² + slide Σ |P L u|²`: `m` the mean normal of an edge's ends, to
//! which it has to be perpendicular (Nehab et al. 2005), `L` the mean of the neighbors less the vertex, `P` the projection onto
//! the tangent plane, so that vertices keep their spacing. Edges have no unit, so bends wider than about
//! `2 π √(3 / hold)` edges stay. Where the surface has the wanted normals already, it is held faster.

use glam::Vec3;
use rayon::prelude::*;

use crate::mesh::{Mesh, Neighbors, conjugate_gradients};

/// Weight of staying where the normals have to turn, and where they are right.
const HOLD: [f32; 2] = [1e-3, 0.2];
/// Turn from which normals count as wrong, radians: 5 degrees.
const WRONG: f32 = 0.087;
/// Averages of the turn over neighbors.
const PASSES: usize = 4;
const SLIDE: f32 = 0.1;
const ITERATIONS: usize = 300;
const CHUNK: usize = 4096;

pub(super) struct Reshape<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) neighbors: &'a Neighbors,
    /// Wanted, unit, per vertex.
    pub(super) normals: &'a [Vec3],
    /// Vertices that may move.
    pub(super) free: &'a [bool],
}

impl Reshape<'_> {
    fn map<T: Send>(&self, of: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
        (0..self.free.len()).into_par_iter().with_min_len(CHUNK).map(of).collect()
    }

    /// Half the gradient of the first term at displaced positions `x`.
    fn slope(&self, x: &[Vec3], v: usize) -> Vec3 {
        let of = |&j: &u32| {
            let j = j as usize;
            let m = (self.normals[v] + self.normals[j]).normalize_or(self.normals[v]);
            m * m.dot(x[v] - x[j])
        };
        self.neighbors.at(v).iter().map(of).sum()
    }

    /// `P L u`.
    fn slid(&self, u: &[Vec3], v: usize) -> Vec3 {
        if !self.free[v] {
            return Vec3::ZERO;
        }
        let bent = self.neighbors.laplacian(u, v);
        bent - self.normals[v] * self.normals[v].dot(bent)
    }

    fn hold(&self) -> Vec<f32> {
        let own = self.mesh.vertex_normals();
        let turn = self.map(|v| own[v].angle_between(self.normals[v]));
        let turn = self.neighbors.smoothed(turn, PASSES);
        let right = |t: f32| (1.0 + (t / WRONG).powi(2)).powi(-2);
        self.map(|v| HOLD[0] + (HOLD[1] - HOLD[0]) * right(turn[v]))
    }

    fn image(&self, u: &[Vec3], hold: &[f32]) -> Vec<Vec3> {
        let slid = self.map(|v| self.neighbors.part(self.slid(u, v), v));
        self.map(|v| {
            if self.free[v] {
                self.slope(u, v)
                    + u[v] * hold[v]
                    + self.neighbors.laplacian_transposed(&slid, v) * SLIDE
            } else {
                Vec3::ZERO
            }
        })
    }

    /// Displacements, by conjugate gradients from rest.
    pub(super) fn solve(&self) -> Vec<Vec3> {
        let x = &self.mesh.vertices;
        let hold = self.hold();
        let residual = self.map(|v| if self.free[v] { -self.slope(x, v) } else { Vec3::ZERO });
        conjugate_gradients::solve(residual, |u| self.image(u, &hold), ITERATIONS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of `n` by `n` vertices over the plane, with heights.
    fn grid(n: usize, height: impl Fn(f32, f32) -> f32) -> Mesh {
        let mut mesh = Mesh::default();
        for k in 0..n * n {
            let (x, y) = ((k % n) as f32, (k / n) as f32);
            mesh.vertices.push(Vec3::new(x, y, height(x, y)));
        }
        for k in (0..n * (n - 1)).filter(|k| k % n + 1 < n).map(|k| k as u32) {
            let n = n as u32;
            mesh.triangles.extend([[k, k + 1, k + n], [k + 1, k + n + 1, k + n]]);
        }
        mesh
    }

    #[test]
    fn a_pit_is_closed_where_the_normals_are_those_of_a_dome() {
        let n = 41;
        let dome = |x: f32, y: f32| {
            let r2 = (x - 20.0).powi(2) + (y - 20.0).powi(2);
            (900.0 - r2.min(890.0)).sqrt()
        };
        let pit = |x: f32, y: f32| {
            let r2 = (x - 23.0).powi(2) + (y - 18.0).powi(2);
            dome(x, y) - 6.0 * (-r2 / 18.0).exp()
        };
        let (truth, mesh) = (grid(n, dome), grid(n, pit));
        let wanted = truth.vertex_normals();
        let inside = |v: &usize| (2..n - 2).contains(&(v % n)) && (2..n - 2).contains(&(v / n));
        let free: Vec<bool> = (0..n * n).map(|v| inside(&v)).collect();
        let neighbors = Neighbors::of(&mesh);
        let shape = Reshape { mesh: &mesh, neighbors: &neighbors, normals: &wanted, free: &free };
        let u = shape.solve();
        assert!((0..n * n).all(|v| free[v] || u[v] == Vec3::ZERO));
        let mut moved = mesh.clone();
        moved.vertices.iter_mut().zip(&u).for_each(|(x, u)| *x += *u);
        let off = |mesh: &Mesh| {
            let normals = mesh.vertex_normals();
            let all = (0..n * n).filter(|v| inside(v));
            let sum: f32 = all
                .map(|v| {
                    // The dome's normal above the place that the vertex is now at.
                    let at = mesh.vertices[v] - Vec3::new(20.0, 20.0, 0.0);
                    let radius = Vec3::new(at.x, at.y, dome(at.x + 20.0, at.y + 20.0));
                    normals[v].dot(radius.normalize()).clamp(-1.0, 1.0).acos().to_degrees()
                })
                .sum();
            sum / (0..n * n).filter(inside).count() as f32
        };
        let (before, after) = (off(&mesh), off(&moved));
        println!("normals off by {before} degrees, then {after}");
        assert!(before > 5.0 && after < 1.5, "{before} {after}");
    }

    #[test]
    fn what_has_its_normals_stays() {
        let mesh = grid(9, |x, y| 0.02 * (x * x + x * y));
        let (normals, neighbors) = (mesh.vertex_normals(), Neighbors::of(&mesh));
        let free = vec![true; 81];
        let flat = grid(9, |x, _| 0.3 * x);
        let up = flat.vertex_normals();
        let still =
            Reshape { mesh: &flat, neighbors: &neighbors, normals: &up, free: &free }.solve();
        assert!(still.iter().all(|u| u.length() < 1e-4));
        let none = vec![false; 81];
        let held = Reshape { mesh: &mesh, neighbors: &neighbors, normals: &normals, free: &none };
        assert!(held.solve().iter().all(|u| *u == Vec3::ZERO));
    }
}
