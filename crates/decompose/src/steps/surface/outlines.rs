//! Where the photos show that things end.
//!
//! Seen from a camera, the surface ends at edges between a triangle that faces it and one that does not. Across each such
//! edge the photo is read along a line: inside it looks like the thing, outside like what is behind, and the place where
//! the one turns into the other says how far the surface has to move along its normal there (after Cipolla & Blake 1992;
//! Furukawa & Ponce 2009). What is behind is known where it is a plane: other photos see that piece of it. So this holds
//! for mirrors too, about which photos never agree otherwise.

use glam::{Vec2, Vec3};
use motes_shading::tracing::{BuildQuality, MeshTracer, Ray, Tracer, TriangleMesh};
use rayon::prelude::*;

use super::view::View;
use crate::mesh::Mesh;

/// Pixels on either side of an outline that are read.
const REACH: f32 = 7.0;
/// Farthest that an outline is looked for, pixels.
const FARTHEST: f32 = 4.0;
/// Between readings, pixels.
const STEP: f32 = 0.5;
const READINGS: usize = (2.0 * REACH / STEP) as usize + 1;
/// What either side looks like is read between these distances from the outline, pixels: near it, as things darken, or
/// mirror what is behind, toward their rim.
const NEAR: (f32, f32) = (0.9, 3.2);
/// What is behind an outline is farther by this many voxels.
const BEHIND: f32 = 8.0;
/// Least error of a reading and of what is known to be behind, in units of perceived brightness.
const NOISE: f32 = 0.025;
/// A reading that fits neither side costs this at most, so that a speck decides nothing.
const MOST_COST: f32 = 9.0;
/// Fall of the cost within one and a half pixels from which an outline counts in full.
const CLEAR: f32 = 12.0;
/// Photos that tell what is behind, at most.
const WITNESSES: usize = 9;

/// What outlines say about one vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outline {
    /// Displacement along the normal, unit world: the mean, weighted.
    pub(super) displacement: f32,
    /// Sum of the weights of the photos, each 0 to 1.
    pub(super) confidence: f32,
}

/// One place of an outline in one photo.
struct Crossing {
    edge: [u32; 2],
    /// Pixel coordinates.
    at: Vec2,
    /// Unit vector outwards, and pixels per unit along the normal of the surface.
    outwards: Vec2,
    pixels_per_unit: f32,
    on_plane: bool,
}

/// What is there to be met: everything, and the planes alone.
pub(super) struct Rays {
    pub(super) all: MeshTracer,
    planes: Option<MeshTracer>,
}

impl Rays {
    /// `None` when there is nothing to be met.
    pub(super) fn new(mesh: &Mesh, planes: &Mesh) -> Option<Self> {
        let tracer = |Mesh { vertices, triangles }: Mesh| {
            let soup = TriangleMesh { vertices, triangles };
            (!soup.triangles.is_empty()).then(|| MeshTracer::new(&soup, BuildQuality::Fast).ok())?
        };
        let mut all = mesh.clone();
        all.append(planes.clone());
        Some(Self { all: tracer(all)?, planes: tracer(planes.clone()) })
    }
}

/// Edges of two triangles with these, ascending.
fn inner_edges(mesh: &Mesh) -> Vec<([u32; 2], [u32; 2])> {
    let mut half: Vec<([u32; 2], u32)> = mesh
        .triangles
        .iter()
        .enumerate()
        .flat_map(|(t, &[a, b, c])| {
            [(a, b), (b, c), (c, a)].map(|(a, b)| ([a.min(b), a.max(b)], t as u32))
        })
        .collect();
    half.par_sort_unstable();
    half.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| (w[0].0, [w[0].1, w[1].1])).collect()
}

/// What the outlines in all photos say about the vertices of `mesh`.
pub(super) fn outlines(
    mesh: &Mesh,
    normals: &[Vec3],
    rays: &Rays,
    views: &[View],
    voxel: f32,
) -> Vec<Outline> {
    let edges = inner_edges(mesh);
    let faces: Vec<(Vec3, f32)> = mesh
        .triangles
        .iter()
        .map(|&t| {
            let n = mesh.area_normal(t);
            (n, n.dot(mesh.vertices[t[0] as usize]))
        })
        .collect();
    let per_view: Vec<Vec<([u32; 2], f32, f32)>> = views
        .par_iter()
        .enumerate()
        .with_max_len(1)
        .map(|(i, view)| {
            let faces_it: Vec<bool> = faces.iter().map(|(n, d)| n.dot(view.center) > *d).collect();
            let crossings: Vec<Crossing> = edges
                .iter()
                .filter(|(_, [s, t])| faces_it[*s as usize] != faces_it[*t as usize])
                .filter_map(|&(edge, _)| crossing(mesh, normals, rays, view, voxel, edge))
                .collect();
            let mut behind =
                Behind { view: i, views, rays, voxel, known: vec![None; view.luma.len()] };
            crossings
                .iter()
                .filter_map(|c| {
                    let (pixels, confidence) = shift(view, c, &mut behind)?;
                    Some((c.edge, pixels / c.pixels_per_unit, confidence))
                })
                .collect()
        })
        .collect();
    let mut out = vec![Outline::default(); mesh.vertices.len()];
    for (edge, displacement, confidence) in per_view.into_iter().flatten() {
        for v in edge {
            let o = &mut out[v as usize];
            o.displacement += confidence * displacement;
            o.confidence += confidence;
        }
    }
    for o in out.iter_mut().filter(|o| o.confidence > 0.0) {
        o.displacement /= o.confidence;
    }
    out
}

fn ray_to(view: &View, at: Vec2) -> Ray {
    Ray::new(view.center, view.ray(at.x, at.y).normalize())
}

/// The place where an edge is an outline in a photo; `None` when something hides it or is right behind it.
fn crossing(
    mesh: &Mesh,
    normals: &[Vec3],
    rays: &Rays,
    view: &View,
    voxel: f32,
    edge: [u32; 2],
) -> Option<Crossing> {
    let [a, b] = edge.map(|v| v as usize);
    let x = 0.5 * (mesh.vertices[a] + mesh.vertices[b]);
    let n = (normals[a] + normals[b]).normalize_or_zero();
    let q = view.project(x)?;
    let moved = view.project(x + n * voxel)?;
    let at = q.truncate();
    let slope = (moved.truncate() - at) / voxel;
    let pixels_per_unit = slope.length();
    // An outline moves by about as much as its surface does; a fold does not.
    if !(pixels_per_unit * q.z * view.footprint() > 0.5) {
        return None;
    }
    let outwards = slope / pixels_per_unit;
    for end in [at + outwards * REACH, at - outwards * REACH] {
        view.pixel(end.x - 1.0, end.y - 1.0)?;
        view.pixel(end.x + 1.0, end.y + 1.0)?;
    }
    let distance = (x - view.center).length();
    let to_it = Ray { t_max: distance - 2.0 * voxel, ..ray_to(view, at) };
    if rays.all.occluded(&to_it) {
        return None;
    }
    let past = ray_to(view, at + 1.5 * outwards);
    let beyond = rays.all.closest_hit(&past).map_or(f32::INFINITY, |h| h.distance);
    if !(beyond > distance + BEHIND * voxel) {
        return None;
    }
    let plane = rays.planes.as_ref().and_then(|p| p.closest_hit(&past));
    let on_plane = plane.is_some_and(|h| h.distance < beyond + voxel);
    Some(Crossing { edge, at, outwards, pixels_per_unit, on_plane })
}

/// What the planes look like where things stand before them in one photo, by the others.
struct Behind<'a> {
    view: usize,
    views: &'a [View],
    rays: &'a Rays,
    voxel: f32,
    /// `[h, w]`; the outer option: whether it was asked for.
    known: Vec<Option<Option<Vec3>>>,
}

impl Behind<'_> {
    /// Color of the plane behind the center of a pixel: median of the photos that see it.
    fn at_pixel(&mut self, column: usize, row: usize) -> Option<Vec3> {
        let view = &self.views[self.view];
        let index = row * view.width + column;
        if let Some(known) = self.known[index] {
            return known;
        }
        let color = self.witnessed(Vec2::new(column as f32 + 0.5, row as f32 + 0.5));
        self.known[index] = Some(color);
        color
    }

    fn witnessed(&self, at: Vec2) -> Option<Vec3> {
        let view = &self.views[self.view];
        let ray = ray_to(view, at);
        let hit = self.rays.planes.as_ref()?.closest_hit(&ray)?;
        let place = ray.at(hit.distance);
        let n = hit.geometric_normal;
        let origin = place - n * n.dot(ray.direction).signum() * 2.0 * self.voxel;
        let mut colors: Vec<Vec3> = Vec::with_capacity(WITNESSES);
        let others = self.views.iter().enumerate().filter(|(j, _)| *j != self.view);
        for (_, other) in others {
            let Some(q) = other.project(place) else { continue };
            let Some(color) = other.color_at(q.truncate()) else { continue };
            let to = other.center - origin;
            let distance = to.length();
            let ray = Ray { t_max: distance, ..Ray::new(origin, to / distance) };
            if !self.rays.all.occluded(&ray) {
                colors.push(color);
                if colors.len() == WITNESSES {
                    break;
                }
            }
        }
        (colors.len() >= 3).then(|| median(&colors))
    }

    /// Between the centers of pixels.
    fn at(&mut self, p: Vec2) -> Option<Vec3> {
        let (x, y) = (p.x - 0.5, p.y - 0.5);
        let (i, j) = (x.floor(), y.floor());
        let (u, v) = (x - i, y - j);
        let (i, j) = (i as usize, j as usize);
        let top = self.at_pixel(i, j)?.lerp(self.at_pixel(i + 1, j)?, u);
        let low = self.at_pixel(i, j + 1)?.lerp(self.at_pixel(i + 1, j + 1)?, u);
        Some(top.lerp(low, v))
    }
}

fn median(colors: &[Vec3]) -> Vec3 {
    Vec3::from([0, 1, 2].map(|c: usize| {
        let mut values: Vec<f32> = colors.iter().map(|v| v[c]).collect();
        values.sort_by(f32::total_cmp);
        let m = values.len() / 2;
        if values.len() % 2 == 1 { values[m] } else { 0.5 * (values[m] + values[m - 1]) }
    }))
}

/// Position of reading `k`, pixels outwards.
fn position(k: usize) -> f32 {
    k as f32 * STEP - REACH
}

/// Mean and mean squared spread of the readings in a range of positions.
fn look(readings: &[Vec3; READINGS], from: f32, to: f32) -> (Vec3, f32) {
    let inside = |k: &usize| (from..=to).contains(&position(*k));
    let n = (0..READINGS).filter(inside).count().max(1) as f32;
    let mean = (0..READINGS).filter(inside).map(|k| readings[k]).sum::<Vec3>() / n;
    let spread = (0..READINGS).filter(inside).map(|k| (readings[k] - mean).length_squared());
    (mean, spread.sum::<f32>() / n)
}

/// How many pixels the outline is off, outwards, with a weight 0 to 1.
fn shift(view: &View, crossing: &Crossing, behind: &mut Behind<'_>) -> Option<(f32, f32)> {
    let mut readings = [Vec3::ZERO; READINGS];
    let mut beyond = [None; READINGS];
    for k in 0..READINGS {
        let p = crossing.at + crossing.outwards * position(k);
        readings[k] = view.color_at(p)?;
        beyond[k] = if crossing.on_plane { behind.at(p) } else { None };
    }
    let mut found = 0.0f32;
    let mut confidence = 0.0;
    for _ in 0..2 {
        let (own, own_spread) = look(&readings, found - NEAR.1, found - NEAR.0);
        let (far, far_spread) = look(&readings, found + NEAR.0, found + NEAR.1);
        let outside = |k: &usize| (NEAR.0..=NEAR.1).contains(&(position(*k) - found));
        let errors: Vec<f32> = (0..READINGS)
            .filter(outside)
            .filter_map(|k| beyond[k].map(|color: Vec3| (readings[k] - color).length_squared()))
            .collect();
        let known_spread = errors.iter().sum::<f32>() / errors.len().max(1) as f32;
        // One measure for both sides: a pixel that is half of each must not go to the more varied one.
        let beyond_spread = if errors.is_empty() { far_spread } else { known_spread };
        let spread = 0.5 * (own_spread + beyond_spread) + 3.0 * NOISE * NOISE;
        let cost = |difference: Vec3| (difference.length_squared() / spread).min(MOST_COST);
        let mut inner = [0.0f32; READINGS];
        let mut outer = [0.0f32; READINGS];
        for k in 0..READINGS {
            inner[k] = cost(readings[k] - own);
            outer[k] = match beyond[k] {
                Some(color) => cost(readings[k] - color),
                None => cost(readings[k] - far),
            };
        }
        // The cost of an outline before reading k: all before it are of the thing, the others of what is behind.
        let mut total: f32 = outer.iter().sum();
        let mut costs = [0.0f32; READINGS + 1];
        for k in 0..=READINGS {
            costs[k] = total;
            if k < READINGS {
                total += inner[k] - outer[k];
            }
        }
        let reach = (FARTHEST / STEP) as usize;
        let middle = READINGS / 2;
        let range = middle + 1 - reach..=middle + reach;
        let best = range.clone().min_by(|&a, &b| costs[a].total_cmp(&costs[b]))?;
        if best == *range.start() || best == *range.end() {
            return None;
        }
        let (low, mid, high) = (costs[best - 1], costs[best], costs[best + 1]);
        let bend = low + high - 2.0 * mid;
        let offset = if bend > 0.0 { (0.5 * (low - high) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        // Before reading k: half a step before its position.
        found = (best as f32 - 0.5 + offset) * STEP - REACH;
        let off = (1.5 / STEP) as usize;
        let margin = costs[best - off].min(costs[best + off]) - mid;
        confidence = (margin / CLEAR).clamp(0.0, 1.0);
    }
    (confidence > 0.05).then_some((found, confidence))
}

#[cfg(test)]
mod tests;
