//! What an object leaves open where it stood.

use glam::Vec3;
use motes_scene::Surface;
use rayon::prelude::*;
use relight::RelightScene;

use super::around::points_around;
use super::bordered::split_by_border;
use super::colors::Projection;
use super::cover::Cover;
use super::grid::Grid;
use super::height_field::{LEVEL, LOOSE, Oriented, raise};
use super::images::Images;
use super::plane_picture::plane_picture;
use super::support::{LEAST_SHARE, Say, support_plane};
use crate::Fill;

/// Cells around what was hidden that were hardly seen either.
const CONTACT: usize = 2;
/// Points within this many edges of a plane lie on it: as few as find one, since ground is as rough as it is.
const TOLERANCE_EDGES: [f32; 4] = [2.0, 4.0, 8.0, 16.0];
/// But for the fewest, no more than this share of the object's size.
const ROUGHEST: f32 = 0.05;
/// Colors next to an opening are those of the object as well, within this share of its size.
const RIM: f32 = 0.04;
/// What is this near to an opening is fitted together with what fills it, share of the object's size.
const REFIT_RIM: f32 = 0.08;
/// Cells of the ground are no wider than this share of the object's size, however coarse the mesh: the rings around a hole are
/// counted in cells.
const FINE: f32 = 0.01;
/// Ground borders an opening that is so near, share of the object's size.
const NEAR: f32 = 0.05;
/// In cells.
const MAX_RIM: usize = 32;
/// Gaps of up to twice as many cells between openings are open, too.
const CLOSING: usize = 4;
/// Gaussians within this many tolerances of a plane hold it: few views place ground less well than a mesh of all does.
const HELD: f32 = 3.0;
/// Share of the level surface at the foot of an object that a plane holds closely, if that is no uneven ground.
const CLEARED_SHARE: f64 = 0.5;
/// What surrounds an object is at its foot below this share of its height.
const FOOT: f32 = 0.1;
/// What an object covers up to this share of its size is not known of uneven ground.
const UNDER: f32 = 0.25;
/// The plane is looked for this share of the object's size around it.
const NEIGHBORHOOD: f32 = 0.35;
/// Gaussians around whose normals agree less with the ground belong to what stands on it.
pub(super) const GROUNDED: f32 = 0.5;
/// Normals of a plane agree with its own by this cosine.
pub(super) const ALIGNED: f32 = 0.9;
/// The grid reaches this share of the object's size beyond it: far enough for colors to go on from, for examples of the
/// texture, and for a piece as large as the hole.
fn margin(fill: Fill) -> f32 {
    match fill {
        Fill::Patch => 1.2,
        Fill::Texture => 0.7,
        Fill::Plane | Fill::None => 0.35,
    }
}

/// A place on a plane that was uncovered.
#[derive(Debug)]
pub(super) struct Hole {
    pub(super) grid: Grid,
    /// Cells that were hidden or have no surface.
    pub(super) open: Vec<bool>,
    /// Cells that would be open if ground bordered them.
    pub(super) floating: usize,
    /// The open cells and those around, which hold what was seen at the foot of the object: its colors and its contact shadow.
    pub(super) blurred: Vec<bool>,
    /// Cells whose surface stayed.
    pub(super) covered: Vec<bool>,
    /// Cells under the foot of what stays on the ground: a blanket, another object.
    pub(super) occupied: Vec<bool>,
    /// How far off the plane its points may be.
    pub(super) tolerance: f32,
    /// How far off the plane the ground may be: farther where it is uneven.
    pub(super) reach: f32,
    /// Diagonal of what left.
    pub(super) object_size: f32,
}

/// What holes are found by.
#[derive(Clone, Copy)]
pub(super) struct Left<'a> {
    pub(super) before: &'a RelightScene,
    pub(super) images: &'a Images,
    pub(super) fate_of_vertex: &'a [u32],
    pub(super) cover: &'a Cover,
}

/// The hole with a number, if matter left one and there is a plane to close it with.
pub(super) fn find_hole(
    matter: &Left<'_>,
    projection: &Projection,
    (number, fill): (u32, Fill),
    seed: u64,
) -> Option<Hole> {
    let Left { before, images, fate_of_vertex, cover } = *matter;
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
    let region = (0.5 * (low + high), (0.5 + NEIGHBORHOOD) * size);
    let around = points_around(surface, &stays, region, seed);
    let (grid, tolerance, reach) =
        ground(&around, &object, size, edge, margin(fill), before.up_in_world, seed)?;
    let covered = covered(&grid, surface, tolerance, &stays);
    let occupied = occupied(&grid, surface, tolerance, &stays);
    let mut under = vec![false; grid.cells()];
    for corners in surface.triangles.iter().filter(|corners| corners.iter().any(|v| left(*v))) {
        grid.mark(&mut under, corners.map(at));
    }
    let under = grid.grown(&under, CONTACT);
    let held = held(&grid, matter, tolerance, projection);
    let raised = grid.plane.normal * before.ray_bias();
    let hidden = |c: usize| cover.hides(grid.point(grid.middle(c)) + raised, grid.plane.normal);
    let open: Vec<bool> = (0..grid.cells())
        .into_par_iter()
        .with_min_len(64)
        .map(|c| under[c] && (!covered[c] || !held[c] || hidden(c)))
        .collect();
    // Where matter met the plane, cameras saw next to nothing; what lies between such places is no better known.
    let open = grid.shrunk(&grid.grown(&open, CONTACT + CLOSING), CLOSING);
    let near_ground = grid.grown(&covered, (NEAR * size / grid.pitch) as usize);
    let (open, floating) = split_by_border(&grid, &open, &near_ground);
    let rim = ((RIM * size / grid.pitch).ceil() as usize).min(MAX_RIM);
    let blurred = grid.grown(&open, rim);
    Some(Hole {
        grid,
        open,
        floating,
        blurred,
        covered,
        occupied,
        tolerance,
        reach,
        object_size: size,
    })
}

/// The ground that an object stood on as cells, and how far off it its points may be: a plane if one holds the surface around,
/// heights over a looser one otherwise.
fn ground(
    around: &[Oriented],
    object: &[Vec3],
    size: f32,
    edge: f32,
    margin: f32,
    up: Vec3,
    seed: u64,
) -> Option<(Grid, f32, f32)> {
    let points: Vec<Vec3> = around.iter().map(|o| o.point).collect();
    let over = |plane| Grid::over(plane, object, cell_width(edge, size), margin * size);
    let tolerances = || {
        let allowed = |edges: &f32| *edges == TOLERANCE_EDGES[0] || edges * edge <= ROUGHEST * size;
        TOLERANCE_EDGES.into_iter().filter(allowed).map(|edges| edges * edge)
    };
    let even = tolerances().find_map(|tolerance| {
        let plane =
            support_plane(&points, object, 0.5 * tolerance, (LEAST_SHARE, Say::Beside), seed)?;
        Some((plane, tolerance))
    });
    if let Some((plane, tolerance)) = even {
        return Some((over(plane)?, tolerance, tolerance));
    }
    // Uneven ground is level all the same, and at the foot of what stands on it: the tops of other things are not.
    let (low, high) = object
        .iter()
        .map(|p| p.dot(up))
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let foot = low + FOOT * (high - low);
    let is_foot = |o: &&Oriented| o.normal.dot(up) >= LEVEL && o.point.dot(up) <= foot;
    let level: Vec<Oriented> = around.iter().filter(is_foot).copied().collect();
    let points: Vec<Vec3> = level.iter().map(|o| o.point).collect();
    // Most of what is around may stand on a plane rather than be of it: leaves, legs, a slab beside.
    let cleared = tolerances().find_map(|tolerance| {
        let plane =
            support_plane(&points, object, 0.5 * tolerance, (CLEARED_SHARE, Say::Alike), seed)?;
        (plane.normal.dot(up) >= ALIGNED).then_some((plane, tolerance))
    });
    if let Some((plane, tolerance)) = cleared {
        return Some((over(plane)?, tolerance, tolerance));
    }
    LOOSE.into_iter().find_map(|share| {
        let plane = support_plane(&points, object, share * size, (LEAST_SHARE, Say::Alike), seed)?;
        if !(plane.normal.dot(up) >= ALIGNED) {
            return None;
        }
        let mut grid = over(plane)?;
        // What is straight under the object and at its foot is not known.
        let mut under = vec![false; grid.cells()];
        for p in object.iter().filter(|p| plane.height(**p) < UNDER * size) {
            grid.cell(plane.flat(*p)).into_iter().for_each(|cell| under[cell] = true);
        }
        let under = grid.grown(&under, 2 * CONTACT);
        let reach = 2.0 * share * size;
        let tolerance = raise(&mut grid, &level, &under, reach, tolerances())?;
        Some((grid, tolerance, reach))
    })
}

/// Cells that Gaussians which stayed and lie in the plane cover. Under an object a splat often has none: what cameras saw
/// past its edge lies as dark matter below the plane.
fn held(grid: &Grid, left: &Left<'_>, tolerance: f32, projection: &Projection) -> Vec<bool> {
    let gaussians = &left.before.gaussians;
    let lies = |i: &u32| {
        let p = Vec3::from(gaussians.means[*i as usize]);
        left.images.of_row(*i).stays()
            && grid.height(p).abs() <= HELD * tolerance
            && grid.cell(grid.plane.flat(p)).is_some()
    };
    let rows: Vec<u32> = (0..gaussians.len() as u32).filter(lies).collect();
    let picture = plane_picture(grid, gaussians, &rows, projection, left.before.antialias);
    picture.iter().map(Option::is_some).collect()
}

/// Cells under triangles that stayed and lie in the plane.
pub(super) fn covered(
    grid: &Grid,
    surface: &Surface,
    tolerance: f32,
    stays: &impl Fn(u32) -> bool,
) -> Vec<bool> {
    let lies = |heights: [f32; 3]| heights.iter().all(|h| h.abs() <= tolerance);
    grid.under_triangles(surface, stays, lies)
}

/// Cells under triangles that stayed and leave the plane where Gaussians still count as of it, and those beside.
fn occupied(
    grid: &Grid,
    surface: &Surface,
    tolerance: f32,
    stays: &impl Fn(u32) -> bool,
) -> Vec<bool> {
    let leaves = |heights: [f32; 3]| {
        let is_low = |h: &f32| *h <= HELD * tolerance;
        heights.iter().any(is_low) && heights.iter().any(|h| *h > tolerance)
    };
    grid.grown(&grid.under_triangles(surface, stays, leaves), CONTACT)
}

/// Width of a cell of the ground under an object of this size, where edges of the mesh are so long.
fn cell_width(edge: f32, size: f32) -> f32 {
    edge.min(FINE * size)
}

fn bounds(points: &[Vec3]) -> Option<(Vec3, Vec3)> {
    let first = *points.first()?;
    Some(points.iter().fold((first, first), |(l, h), p| (l.min(*p), h.max(*p))))
}

impl Hole {
    /// Whether a Gaussian that stayed was hidden in the object, or part of the plane over cells that are open now.
    pub(super) fn was_inside(&self, before: &RelightScene, cover: &Cover, row: usize) -> bool {
        let plane = &self.grid.plane;
        let p = Vec3::from(before.gaussians.means[row]);
        let height = self.grid.height(p);
        let largest = before.gaussians.log_scales[row].into_iter().fold(f32::MIN, f32::max).exp();
        // What lies deeper does not show.
        if !(height > -3.0 * self.tolerance.max(largest)) {
            return false;
        }
        let raised = p + plane.normal * (before.ray_bias() - height).max(0.0);
        if cover.hides(raised, plane.normal) {
            return true;
        }
        if height < -HELD * self.tolerance {
            // Below the plane nothing was to be seen but through the hole.
            let mut around = (0..8).map(|k| {
                let (sin, cos) = (std::f32::consts::FRAC_PI_4 * k as f32).sin_cos();
                p + (plane.axes[0] * cos + plane.axes[1] * sin) * largest
            });
            return self.is_open(p) || around.any(|p| self.is_open(p));
        }
        let normal = Vec3::from(before.materials.normals[row]);
        let is_ground =
            || height < -self.tolerance || self.on_plane(p) && normal.dot(plane.normal) > ALIGNED;
        self.is_open(p) && (is_ground() || cover.is_over(p, plane.normal))
    }

    /// Whether a point is over an open cell.
    fn is_open(&self, p: Vec3) -> bool {
        self.grid.cell(self.grid.plane.flat(p)).is_some_and(|c| self.open[c])
    }

    /// Whether a vertex that stayed is hidden in the object, or part of the plane over cells that are open now.
    pub(super) fn replaces(&self, cover: &Cover, p: Vec3) -> bool {
        (self.on_plane(p) && self.is_open(p)) || cover.hides(p, self.grid.plane.normal)
    }

    /// Whether a point is in the plane and close to the open cells but not over them.
    pub(super) fn on_rim(&self, rim: &[bool], p: Vec3) -> bool {
        self.grid.height(p).abs() <= HELD * self.tolerance
            && self.grid.cell(self.grid.plane.flat(p)).is_some_and(|c| rim[c])
    }

    /// Cells around the open ones as far as a fit of the filling reaches.
    pub(super) fn rim(&self) -> Vec<bool> {
        self.grid.grown(&self.open, self.rim_width())
    }

    /// Width of the rim, cells.
    pub(super) fn rim_width(&self) -> usize {
        ((REFIT_RIM * self.object_size / self.grid.pitch).ceil() as usize).min(MAX_RIM)
    }

    /// Whether a point is no higher than what holds the plane.
    pub(super) fn is_low(&self, p: Vec3) -> bool {
        self.grid.height(p) <= HELD * self.tolerance
    }

    /// Whether a point may be of the ground, near or far.
    pub(super) fn is_ground(&self, p: Vec3, normal: Vec3) -> bool {
        let least = if self.grid.is_uneven() { LEVEL } else { ALIGNED };
        self.grid.plane.height(p).abs() <= self.reach && normal.dot(self.grid.plane.normal) > least
    }

    /// Another grid over the same plane with the heights of the ground, where that is uneven; none where it is not ground.
    pub(super) fn raised(&self, mut grid: Grid, surface: &Surface, seed: u64) -> Option<Grid> {
        if !self.grid.is_uneven() {
            return Some(grid);
        }
        let extent = grid.size.map(|n| n as f32);
        let center = grid.plane.point(grid.corner_at(extent.map(|n| 0.5 * n)));
        let radius = 0.5 * grid.pitch * extent[0].hypot(extent[1]);
        let around = points_around(surface, &|_| true, (center, radius), seed);
        let under: Vec<bool> = (0..grid.cells())
            .map(|c| self.grid.cell(grid.middle(c)).is_some_and(|c| self.open[c]))
            .collect();
        raise(&mut grid, &around, &under, self.reach, std::iter::once(self.tolerance))?;
        Some(grid)
    }

    /// Whether a point lies on the plane.
    pub(super) fn on_plane(&self, p: Vec3) -> bool {
        self.grid.height(p).abs() <= self.tolerance
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
                    lid.vertices.push(grid.point(flat).to_array());
                    lid.normals.push(grid.normal(flat).to_array());
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_around_a_hole_are_narrow_under_a_small_object_on_a_coarse_mesh() {
        assert_eq!(cell_width(0.1, 1.0), 0.01);
        assert_eq!(cell_width(0.004, 1.0), 0.004, "a fine mesh says more");
    }
}
