//! What an object leaves open where it stood.

use glam::Vec3;
use motes_math::rng::keyed_rng;
use motes_relighting::RelightScene;
use motes_scene::Surface;
use motes_shading::tracing::Ray;
use rand::RngExt;

use super::grid::Grid;
use super::images::Images;
use super::support::support_plane;
use crate::Fill;

/// Cells around what was hidden that were hardly seen either.
const CONTACT: usize = 2;
/// Points within this many edges of a plane lie on it.
const TOLERANCE_EDGES: f32 = 2.0;
/// Points that are drawn around an object to find its plane.
const POINTS: usize = 16_384;
const PURPOSE: u64 = 0x484f_4c45;
/// The plane is looked for this share of the object's size around it.
const NEIGHBOURHOOD: f32 = 0.35;
/// Normals of a plane agree with its own by this cosine.
pub(super) const ALIGNED: f32 = 0.9;
/// The grid reaches this share of the object's size beyond it: far enough for colours to go on from, and for a
/// piece as large as the hole.
fn margin(fill: Fill) -> f32 {
    if fill == Fill::Patch { 1.2 } else { 0.35 }
}

/// A place on a plane that was uncovered.
#[derive(Debug)]
pub(super) struct Hole {
    pub(super) grid: Grid,
    /// Cells without surface.
    pub(super) open: Vec<bool>,
    /// Cells whose surface stayed.
    pub(super) covered: Vec<bool>,
    /// How far off the plane its points may be.
    pub(super) tolerance: f32,
    /// Diagonal of what left.
    pub(super) object_size: f32,
}

/// The hole with a number, if matter left one and there is a plane to close it with.
pub(super) fn find_hole(
    before: &RelightScene,
    images: &Images,
    fate_of_vertex: &[u32],
    (number, fill): (u32, Fill),
    seed: u64,
) -> Option<Hole> {
    let surface = before.surface();
    let at = |v: u32| Vec3::from(surface.vertices[v as usize]);
    let left = |v: u32| images.fate(fate_of_vertex[v as usize]).hole == Some(number);
    let stays = |v: u32| images.fate(fate_of_vertex[v as usize]).stays();
    let vertices = 0..surface.vertices.len() as u32;
    let object: Vec<Vec3> =
        vertices.clone().filter(|&v| left(v)).map(at).filter(|p| p.is_finite()).collect();
    let (low, high) = bounds(&object)?;
    let size = (high - low).length();
    let edge = 2.0 * before.ray_bias();
    let tolerance = TOLERANCE_EDGES * edge;
    let region = (0.5 * (low + high), (0.5 + NEIGHBOURHOOD) * size);
    let around = points_around(surface, &stays, region, seed);
    let plane = support_plane(&around, &object, 0.5 * tolerance, seed)?;
    let grid = Grid::over(plane, &object, edge, margin(fill) * size)?;
    let covered = covered(&grid, surface, tolerance, &stays);
    let mut under = vec![false; grid.cells()];
    for corners in surface.triangles.iter().filter(|corners| corners.iter().any(|v| left(*v))) {
        grid.mark(&mut under, corners.map(at));
    }
    let open: Vec<bool> = (0..grid.cells()).map(|c| under[c] && !covered[c]).collect();
    // Where matter met the plane, cameras saw next to nothing.
    let open = grid.grown(&open, CONTACT);
    Some(Hole { grid, open, covered, tolerance, object_size: size })
}

/// Cells under triangles that stayed and lie in the plane.
pub(super) fn covered(
    grid: &Grid,
    surface: &Surface,
    tolerance: f32,
    stays: &impl Fn(u32) -> bool,
) -> Vec<bool> {
    let mut covered = vec![false; grid.cells()];
    for corners in surface.triangles.iter().filter(|corners| corners.iter().all(|v| stays(*v))) {
        let triangle = corners.map(|v| Vec3::from(surface.vertices[v as usize]));
        if triangle.iter().all(|p| grid.plane.height(*p).abs() <= tolerance) {
            grid.mark(&mut covered, triangle);
        }
    }
    covered
}

fn bounds(points: &[Vec3]) -> Option<(Vec3, Vec3)> {
    let first = *points.first()?;
    Some(points.iter().fold((first, first), |(l, h), p| (l.min(*p), h.max(*p))))
}

/// Points of triangles that stayed, evenly spread over their area, within a ball.
fn points_around(
    surface: &Surface,
    stays: &impl Fn(u32) -> bool,
    (center, radius): (Vec3, f32),
    seed: u64,
) -> Vec<Vec3> {
    let corners = |t: &[u32; 3]| t.map(|v| Vec3::from(surface.vertices[v as usize]));
    let near = |t: &&[u32; 3]| {
        let [a, b, c] = corners(t);
        let middle = (a + b + c) / 3.0;
        let reach = a.distance(middle).max(b.distance(middle)).max(c.distance(middle));
        t.iter().all(|v| stays(*v)) && middle.distance(center) <= radius + reach
    };
    let triangles: Vec<[u32; 3]> = surface.triangles.iter().filter(near).copied().collect();
    // A triangle much larger than the ball shall not draw all points to where it is far away.
    let most = radius * radius;
    let mut sum = 0.0f64;
    let areas: Vec<f64> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            sum += f64::from((0.5 * (b - a).cross(c - a).length()).min(most));
            sum
        })
        .collect();
    if !(sum > 0.0) {
        return Vec::new();
    }
    let mut rng = keyed_rng(seed, PURPOSE, 0);
    let draw = |_| {
        let at = areas.partition_point(|a| *a < rng.random_range(0.0..sum));
        let [a, b, c] = corners(&triangles[at.min(triangles.len() - 1)]);
        let (mut u, mut v): (f32, f32) = (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0));
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        a + (b - a) * u + (c - a) * v
    };
    (0..POINTS).map(draw).filter(|p| p.distance(center) <= radius).collect()
}

impl Hole {
    /// Whether a point that stayed was hidden in the object, or part of the plane, over cells that are open now.
    pub(super) fn was_inside(
        &self,
        before: &RelightScene,
        p: Vec3,
        normal: Vec3,
        left: impl Fn(u32) -> bool,
    ) -> bool {
        let plane = &self.grid.plane;
        let over_open = self.grid.cell(plane.flat(p)).is_some_and(|c| self.open[c]);
        if !over_open || plane.height(p) < -3.0 * self.tolerance {
            return false;
        }
        if self.on_plane(p) && normal.dot(plane.normal) > ALIGNED {
            return true;
        }
        let start = p.max_element().abs().max(1.0) * 1e-6;
        let up = Ray { t_min: start, ..Ray::new(p, plane.normal) };
        before
            .first_triangle(&up)
            .is_some_and(|t| before.surface().triangles[t as usize].iter().any(|v| left(*v)))
    }

    /// Whether a point lies on the plane.
    pub(super) fn on_plane(&self, p: Vec3) -> bool {
        self.grid.plane.height(p).abs() <= self.tolerance
    }

    /// A mesh over the open cells and one ring around them, without material.
    pub(super) fn lid(&self) -> Surface {
        let grid = &self.grid;
        let row = grid.size[0] + 1;
        let mut number = vec![u32::MAX; row * (grid.size[1] + 1)];
        let mut lid = Surface::default();
        let open = grid.grown(&self.open, 1);
        for cell in (0..grid.cells()).filter(|c| open[*c]) {
            let (x, y) = (cell % grid.size[0], cell / grid.size[0]);
            let corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| {
                let slot = &mut number[y * row + x];
                if *slot == u32::MAX {
                    *slot = lid.vertices.len() as u32;
                    let flat = grid.corner_at([x as f32, y as f32]);
                    lid.vertices.push(grid.plane.point(flat).to_array());
                    lid.normals.push(grid.plane.normal.to_array());
                }
                *slot
            });
            let [a, b, c, d] = corners;
            lid.triangles.extend([[a, b, c], [a, c, d]]);
        }
        lid
    }

    /// Number of open cells.
    pub(super) fn open_cells(&self) -> usize {
        self.open.iter().filter(|open| **open).count()
    }
}
