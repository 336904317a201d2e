//! Displacements of the vertices along their normals, round by round.

use glam::Vec3;
use motes_scene::Surface;
use rayon::prelude::*;

use super::received::{Received, Shaded};
use super::solve::{Displacement, Told, Weights};
use super::turns::{Rows, turns};
use crate::mesh::{Mesh, Neighbors};
use crate::observation::samples::body_radiance;

/// Photos from which a vertex counts.
const LEAST_PHOTOS: usize = 3;
/// Least of what a vertex receives, as a share of what it would if it faced its light.
const LEAST_COSINE: f32 = 0.1;
/// Vertices from which there is a shape to speak of.
const LEAST_VERTICES: usize = 30;
/// Difference of logarithms of base colors, over all channels, at which a pair counts a quarter.
const SIGMA: f32 = 0.3;
/// Weight of squares of displacements, in edges: small, so that it rules only where no pair tells anything.
const HOLD: f32 = 3e-3;
/// Farthest that a vertex moves, edges.
const FARTHEST: f32 = 2.0;

/// What shading moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Displaced {
    /// Vertices that were free to move and are told by photos.
    pub vertices: usize,
    /// Mean cost of pairs of neighbors, 0 to 1: before, after.
    pub cost: [f64; 2],
    /// Mean turn of their normals, degrees.
    pub turn_degrees: f32,
}

impl Shaded<'_> {
    /// The displaced surface after `rounds`; none where nothing can move, or photos do not tell.
    pub(crate) fn reshaped(&self, rounds: u32) -> Option<(Surface, Displaced)> {
        let surface = &self.scene.surface;
        // Metals are told by their reflections.
        let free = self.scene.off_sheets(|v| !(self.materials.metallic[v] > 0.5));
        if free.iter().filter(|f| **f).count() < LEAST_VERTICES {
            return None;
        }
        let mut mesh = Mesh::of(surface);
        let edge = mesh.median_edge(&free)?;
        let first = mesh.vertices.clone();
        // Normals may be better than those of the mesh: predicted ones, say. They turn as the mesh does.
        let along: Vec<Vec3> = surface.normals.iter().map(|&n| Vec3::from(n)).collect();
        let before = mesh.vertex_normals();
        let turned = |mesh: &Mesh| -> Vec<Vec3> {
            let now = mesh.vertex_normals();
            let of = |v: usize| (along[v] + (now[v] - before[v])).normalize_or(along[v]);
            (0..now.len()).map(of).collect()
        };
        let shown: Vec<Vec<Option<Vec3>>> =
            (0..self.lights.len()).map(|l| self.shown(l, &along, &free)).collect();
        if shown.iter().flatten().flatten().count() < LEAST_VERTICES {
            return None;
        }
        let neighbors = Neighbors::of(&mesh);
        let received: Vec<Received> =
            (0..self.lights.len()).map(|l| Received::trace(self, l, &along, &free)).collect();
        let even: Vec<Vec<f32>> = received.iter().map(|r| r.evenness(&neighbors)).collect();
        let weights = Weights { sigma: SIGMA, bending: self.smoothness, hold: HOLD };
        let mut u = vec![0.0f32; free.len()];
        let mut cost = [0.0; 2];
        for round in 0..rounds {
            let normals = turned(&mesh);
            let map = turns(&mesh, &along, &free);
            let told: Vec<Told> = received
                .iter()
                .zip(&shown)
                .zip(&even)
                .map(|((received, shown), weight)| Told {
                    log_base: log_base(received, shown, &normals),
                    by_displacement: slopes(received, &map, &normals, edge),
                    weight,
                })
                .collect();
            let displacement = Displacement {
                told: &told,
                neighbors: &neighbors,
                free: &free,
                start: &u,
                weights,
            };
            if round == 0 {
                cost[0] = displacement.cost(&vec![0.0; free.len()]);
            }
            let step = displacement.solve();
            cost[1] = displacement.cost(&step);
            for v in (0..free.len()).filter(|&v| free[v] && step[v].is_finite()) {
                u[v] = (u[v] + step[v]).clamp(-FARTHEST, FARTHEST);
                mesh.vertices[v] = first[v] + along[v] * (u[v] * edge);
            }
        }
        let normals = turned(&mesh);
        let mut out = surface.clone();
        let mut report = Displaced { vertices: 0, cost, turn_degrees: 0.0 };
        for v in (0..free.len()).filter(|&v| free[v]) {
            out.vertices[v] = mesh.vertices[v].to_array();
            out.normals[v] = normals[v].to_array();
            if shown.iter().any(|shown| shown[v].is_some()) {
                report.vertices += 1;
                report.turn_degrees += normals[v].angle_between(along[v]).to_degrees();
            }
        }
        report.turn_degrees /= report.vertices.max(1) as f32;
        Some((out, report))
    }

    /// What photos under light `l` show of vertices, little touched by highlights.
    fn shown(&self, l: usize, normals: &[Vec3], free: &[bool]) -> Vec<Option<Vec3>> {
        let of = |v: usize| {
            if !free[v] {
                return None;
            }
            let position = Vec3::from(self.scene.surface.vertices[v]);
            let views = self.views.iter().enumerate();
            let mut seen: Vec<_> = views
                .filter(|(_, view)| view.photo.light == l)
                .filter_map(|(k, view)| view.observe(k, position, normals[v]))
                .collect();
            let least = LEAST_PHOTOS.min(self.views.len());
            let radiance = (seen.len() >= least).then(|| body_radiance(&mut seen)).flatten();
            radiance.filter(|r| r.min_element() > 0.0)
        };
        (0..free.len()).into_par_iter().with_min_len(64).map(of).collect()
    }
}

/// Logarithms of base colors under these normals; none where the light grazes or photos do not tell.
fn log_base(received: &Received, shown: &[Option<Vec3>], normals: &[Vec3]) -> Vec<Option<Vec3>> {
    let of = |v: usize| {
        let toward = &received.toward[v];
        let is_lit = |g: &Vec3| normals[v].dot(*g) > LEAST_COSINE * g.length();
        let irradiance = Vec3::from(toward.map(|g| normals[v].dot(g)));
        shown[v].filter(|_| toward.iter().all(is_lit)).map(|l| l.ln() - irradiance.ln())
    };
    (0..normals.len()).map(of).collect()
}

/// Change of these logarithms, per channel, by displacements in edges.
fn slopes(received: &Received, map: &Rows<Vec3>, normals: &[Vec3], edge: f32) -> Rows<Vec3> {
    map.map(|v, turn| {
        let of = |g: Vec3| {
            let irradiance = normals[v].dot(g).max(LEAST_COSINE * g.length());
            if irradiance > 0.0 { -g.dot(turn) * edge / irradiance } else { 0.0 }
        };
        Vec3::from(received.toward[v].map(of))
    })
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
