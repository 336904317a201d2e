//! One round: normals searched on points of metal, vertices moved so that the surface has them.

use std::collections::BTreeMap;

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_scene::Surface;
use motes_shading::environment::Environment;
use rayon::prelude::*;

use super::mirrored::{Incoming, Mirrored, Point};
use super::normals::{Field, Found, LEAST_PHOTOS, Seen, mean};
use super::reshape::Reshape;
use crate::appearance::VertexMaterials;
use crate::mesh::{Mesh, Neighbors};
use crate::observation::{SeenView, TracedSurface};
use crate::parabola::least_of_parabola;

/// Distance of points, edges of the mesh.
const SPACING: f32 = 2.0;
/// Points at most, over all lights: each stores 11 kB per light.
const MOST_POINTS: usize = 10_000;
/// Vertices of metal from which there is a shape to speak of.
const LEAST_VERTICES: usize = 30;
const AROUND: usize = 9;
/// Points that give a vertex its normal.
const NEAREST: usize = 4;
/// Steps from point to point that what photos tell carries to where they see nothing, such as the wall of a pit.
const CARRIED: usize = 6;
/// Farthest that a vertex moves, edges of the mesh.
const FARTHEST: f32 = 30.0;

/// Values of roughness that are compared.
const ROUGHNESS: [f32; 8] = [0.1, 0.15, 0.2, 0.28, 0.36, 0.45, 0.6, 0.75];

/// What photos leave unexplained, as a first guess that [`Mirrors::search`] replaces.
const FIRST_MISFIT: f32 = 0.03;

/// What one round did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MirrorRound {
    /// Points of metal whose normals were searched.
    pub points: usize,
    /// Mean squared difference of the square roots of radiance, in units of its mean, cut: before, and after the first search,
    /// which tells how far photos count in the second.
    pub cost: [f32; 2],
    /// Mean turn of the normals, degrees.
    pub turn_degrees: f32,
}

/// Metals as their reflections have them.
pub(crate) struct Reshaped {
    pub surface: Surface,
    /// Per vertex: the roughness that explains the photos best together with the best normals; none off metals.
    pub roughness: Vec<Option<f32>>,
    pub round: MirrorRound,
}

/// What reshaping needs to know.
pub(crate) struct Mirrors<'a> {
    pub scene: &'a TracedSurface,
    pub views: &'a [SeenView<'a>],
    pub lights: &'a [Environment],
    /// Per light and vertex; empty for nothing.
    pub vertex_radiance: &'a [Vec<Vec3>],
    pub materials: &'a VertexMaterials,
    pub smoothness: f32,
    pub ray_bias: f32,
}

impl Mirrors<'_> {
    /// The surface with its metals turned to what they mirror; none without metal, or without photos of it.
    pub(crate) fn reshaped(&self, seed: u64) -> Option<Reshaped> {
        let free = self.scene.off_sheets(|v| self.materials.metallic[v] > 0.5);
        let metal: Vec<usize> = (0..free.len()).filter(|&v| free[v]).collect();
        if metal.len() < LEAST_VERTICES {
            return None;
        }
        let mesh = Mesh::of(&self.scene.surface);
        let edge = mesh.median_edge(&free)?;
        let points = self.points(&mesh, &metal, edge);
        let best = self.search(&points, seed);
        let turns = points.iter().zip(&best.normals).map(|(p, n)| p.normal.angle_between(*n));
        let round = MirrorRound {
            points: points.len(),
            cost: best.cost,
            turn_degrees: turns.sum::<f32>().to_degrees() / points.len().max(1) as f32,
        };
        let roughness = |v: usize| {
            let part = self.materials.part[v] as usize;
            best.roughness.get(part).copied().filter(|_| free[v])
        };
        let roughness = (0..free.len()).map(roughness).collect();
        let wanted = self.wanted(&points, &best, &free);
        Some(Reshaped { surface: self.moved(mesh, &wanted, &free, edge), roughness, round })
    }

    /// Vertices of metal, one per cell of a grid.
    fn points(&self, mesh: &Mesh, metal: &[usize], edge: f32) -> Vec<Point> {
        let most = (MOST_POINTS / self.lights.len().max(1)).max(LEAST_VERTICES);
        let mut cell = SPACING * edge;
        loop {
            let mut first: BTreeMap<[i32; 3], usize> = BTreeMap::new();
            for &v in metal {
                let key = (mesh.vertices[v] / cell).floor().as_ivec3().to_array();
                first.entry(key).or_insert(v);
            }
            if first.len() <= most {
                let mut kept: Vec<usize> = first.into_values().collect();
                kept.sort_unstable();
                let of = |v: usize| Point {
                    position: mesh.vertices[v],
                    normal: Vec3::from(self.scene.surface.normals[v]).normalize_or(Vec3::Z),
                    part: self.materials.part[v],
                };
                return kept.into_iter().map(of).collect();
            }
            cell *= 1.2;
        }
    }

    /// The best normals under every roughness, and of these the best for each part.
    ///
    /// What photos say counts by how far the best normals leave them unexplained: under a light that was found too soft,
    /// normals are smoother.
    fn search(&self, points: &[Point], seed: u64) -> Best {
        let mut seen: Vec<Vec<Seen>> = points.par_iter().map(|p| self.seen(p)).collect();
        let (sum, count) = seen.iter().flatten().fold((0.0f64, 0.0f64), |(s, n), o| {
            (s + f64::from(o.root.length_squared()) / 3.0, n + 1.0)
        });
        let scale = if sum > 0.0 { (count / sum) as f32 } else { 1.0 };
        seen.iter_mut().flatten().for_each(|o| o.root *= scale.sqrt());
        let incoming: Vec<Incoming> = self
            .lights
            .iter()
            .enumerate()
            .map(|(l, light)| {
                let bounce = self.vertex_radiance.get(l).map_or(&[][..], Vec::as_slice);
                Incoming::trace(self.scene, light, bounce, points, scale, self.ray_bias, seed)
            })
            .collect();
        let around = around(points);
        let under = |r: f32, smoothness: f32| {
            let mirrored: Vec<Mirrored> = incoming.iter().map(|i| i.blurred(r)).collect();
            Field { seen: &seen, points, mirrored: &mirrored, around: &around, smoothness }
                .minimize(seed)
        };
        let weight = self.smoothness.max(0.0);
        let first: Vec<Found> =
            ROUGHNESS.iter().map(|&r| under(r, weight * FIRST_MISFIT)).collect();
        let choice = Choice::of(&first);
        let before = first.iter().map(|f| f.before).fold(f32::INFINITY, f32::min);
        let misfit = mean(&choice.pick(points, &first, |found, p| found.costs[p]));
        let again = |(k, found): (usize, &Found)| {
            let is_chosen = choice.0.contains(&k);
            if is_chosen { under(ROUGHNESS[k], weight * misfit) } else { found.clone() }
        };
        let again: Vec<Found> = first.iter().enumerate().map(again).collect();
        let mut told: Vec<bool> = seen.iter().map(|s| s.len() >= LEAST_PHOTOS).collect();
        for _ in 0..CARRIED {
            told = (0..told.len())
                .map(|p| told[p] || around[p].iter().any(|&q| told[q as usize]))
                .collect();
        }
        Best {
            normals: choice.pick(points, &again, |found, p| found.normals[p]),
            told,
            roughness: choice.roughness(&first),
            cost: [before, misfit],
        }
    }

    fn seen(&self, point: &Point) -> Vec<Seen> {
        let views = self.views.iter().enumerate();
        views
            .filter_map(|(k, view)| view.observe(k, point.position, point.normal))
            .map(|o| {
                let r = o.radiance.max(Vec3::ZERO);
                let root = Vec3::new(r.x.sqrt(), r.y.sqrt(), r.z.sqrt());
                Seen { to_viewer: o.to_viewer, root, light: o.light }
            })
            .collect()
    }

    /// Normal of every vertex: that of the points near it, else its own, also where no photo tells.
    fn wanted(&self, points: &[Point], best: &Best, free: &[bool]) -> Vec<Vec3> {
        let positions: Vec<[f32; 3]> = points.iter().map(|p| p.position.to_array()).collect();
        let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&positions).ok();
        let of = |v: usize| {
            let own = Vec3::from(self.scene.surface.normals[v]);
            let Some(tree) = tree.as_ref().filter(|_| free[v]) else { return own };
            let near = nearest(tree, &self.scene.surface.vertices[v], NEAREST);
            if !near.first().is_some_and(|(_, q)| best.told[*q as usize]) {
                return own;
            }
            let sum: Vec3 = near
                .iter()
                // Not from the other side of a thin thing.
                .filter(|(_, q)| points[*q as usize].normal.dot(own) > 0.0)
                .map(|&(d2, q)| best.normals[q as usize] / (d2.sqrt() + 1e-6 * self.scene.extent))
                .sum();
            sum.normalize_or(own)
        };
        (0..free.len()).into_par_iter().with_min_len(256).map(of).collect()
    }

    fn moved(&self, mut mesh: Mesh, wanted: &[Vec3], free: &[bool], edge: f32) -> Surface {
        let neighbors = Neighbors::of(&mesh);
        let u = Reshape { mesh: &mesh, neighbors: &neighbors, normals: wanted, free }.solve();
        let mut surface = self.scene.surface.clone();
        for (v, u) in u.iter().enumerate().filter(|(v, u)| free[*v] && u.is_finite()) {
            mesh.vertices[v] += u.clamp_length_max(FARTHEST * edge);
            surface.vertices[v] = mesh.vertices[v].to_array();
        }
        let normals = mesh.vertex_normals();
        for v in (0..free.len()).filter(|&v| free[v]) {
            surface.normals[v] = normals[v].to_array();
        }
        surface
    }
}

/// What the search found.
struct Best {
    normals: Vec<Vec3>,
    /// Whether photos tell about a point, or about one near it.
    told: Vec<bool>,
    /// Of every part.
    roughness: Vec<f32>,
    cost: [f32; 2],
}

/// The best of [`ROUGHNESS`] for every part.
struct Choice(Vec<usize>);

impl Choice {
    fn of(all: &[Found]) -> Self {
        let parts = all.first().map_or(0, |f| f.energies.len());
        let best_of = |part: usize| {
            let energy = |k: &usize| all[*k].energies[part];
            (0..all.len()).min_by(|a, b| energy(a).total_cmp(&energy(b))).unwrap_or(0)
        };
        Self((0..parts).map(best_of).collect())
    }

    /// What was chosen and its neighbors, by a parabola.
    fn roughness(&self, all: &[Found]) -> Vec<f32> {
        let refined = |(part, &at): (usize, &usize)| {
            let curve: Vec<f64> = all.iter().map(|f| f.energies[part]).collect();
            least_of_parabola(&ROUGHNESS, &curve, at)
        };
        self.0.iter().enumerate().map(refined).collect()
    }

    /// A value per point, of what was found under the roughness of its part.
    fn pick<T>(&self, points: &[Point], all: &[Found], of: impl Fn(&Found, usize) -> T) -> Vec<T> {
        let pick = |(p, point): (usize, &Point)| of(&all[self.0[point.part as usize]], p);
        points.iter().enumerate().map(pick).collect()
    }
}

fn nearest(tree: &ImmutableKdTree<f32, 3>, at: &[f32; 3], count: usize) -> Vec<(f32, u32)> {
    let Some(count) = std::num::NonZero::new(count) else { return Vec::new() };
    let found = tree.query(at).nearest_n::<SquaredEuclidean<f32>>(count).execute();
    found.into_iter().map(|n| (n.distance, n.item)).collect()
}

/// Points near every point that are of the same side and part.
fn around(points: &[Point]) -> Vec<Vec<u32>> {
    let positions: Vec<[f32; 3]> = points.iter().map(|p| p.position.to_array()).collect();
    let Ok(tree) = ImmutableKdTree::<f32, 3>::new_from_slice(&positions) else {
        return vec![Vec::new(); points.len()];
    };
    let of = |p: usize| -> Vec<u32> {
        nearest(&tree, &positions[p], AROUND)
            .into_iter()
            .map(|(_, q)| q)
            .filter(|&q| {
                let (own, other) = (&points[p], &points[q as usize]);
                q as usize != p && own.part == other.part && own.normal.dot(other.normal) > -0.2
            })
            .collect()
    };
    (0..points.len()).into_par_iter().with_min_len(64).map(of).collect()
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
