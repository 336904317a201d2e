//! The part of a plane that is surface, as a regular grid of its own: no noise, no holes under
//! what stands on it, few triangles far away.

mod completed;

use glam::{IVec2, Vec2, Vec3};

use super::contour;
use super::flatness::{Rivals, is_uneven};
use super::planes::{Plane, reach};
use super::splat_depth::DepthMap;
use super::view::View;
use crate::mesh::Mesh;

/// Cells at most: a larger plane gets larger cells.
const MOST_CELLS: f32 = 400_000.0;
/// Cells to each side of one whose patches speak for it.
const BUMP_REACH: i32 = 4;
/// Gaps up to this many cells are closed.
const CLOSE: i32 = 3;

/// Occupied cells of a plane.
pub(super) struct Sheet {
    pub(super) plane: Plane,
    axes: [Vec3; 2],
    origin: Vec3,
    cell: f32,
    size: IVec2,
    filled: Vec<bool>,
    /// Cells that more pixels look through.
    open: Vec<bool>,
}

/// What the ray of a pixel says about a plane.
pub(super) struct Crossing {
    pub(super) depth: f32,
    pub(super) at: Vec3,
}

fn crossing(plane: &Plane, view: &View, ray: Vec3) -> Option<Crossing> {
    let depth = plane.depth(view, ray)?;
    Some(Crossing { depth, at: view.center + ray * depth })
}

impl Sheet {
    /// The cells that more pixels see on the plane than look through; `None` when there are none.
    /// `tolerance` in the unit world at pixels of the size of a voxel.
    pub(super) fn new(
        plane: Plane,
        views: &[View],
        maps: &[DepthMap],
        tolerance: f32,
        voxel: f32,
        cell: f32,
    ) -> Option<Self> {
        let u = plane.normal.any_orthonormal_vector();
        let axes = [u, plane.normal.cross(u)];
        let flat = |p: Vec3| Vec2::new(p.dot(axes[0]), p.dot(axes[1]));
        let mut votes: Vec<(Vec2, bool)> = Vec::new();
        for (view, map) in views.iter().zip(maps) {
            for (i, &z) in map.depth.iter().enumerate() {
                let ray = view.pixel_ray([i % view.width, i / view.width]);
                let Some(c) = crossing(&plane, view, ray) else { continue };
                let (on, through) = verdict(&plane, view, &c, ray, z, tolerance, voxel);
                if on || through {
                    votes.push((flat(c.at), on));
                }
            }
        }
        let held = votes.iter().filter(|v| v.1).map(|v| v.0);
        let (low, high) = bounds(held)?;
        let cell = cell.max(((high - low).element_product().max(0.0) / MOST_CELLS).sqrt());
        let margin = (CLOSE + 1) as f32 * cell;
        let low = low - margin;
        let size = ((high + margin - low) / cell).ceil().as_ivec2().max(IVec2::ONE);
        let mut score = vec![0i32; (size.x * size.y) as usize];
        for (p, on) in votes {
            let c = ((p - low) / cell).floor().as_ivec2();
            if c.cmpge(IVec2::ZERO).all() && c.cmplt(size).all() {
                score[(c.y * size.x + c.x) as usize] += if on { 1 } else { -1 };
            }
        }
        let filled = score.iter().map(|&s| s > 0).collect();
        let open = score.iter().map(|&s| s < 0).collect();
        let origin = plane.normal * plane.offset + axes[0] * low.x + axes[1] * low.y;
        Some(Self { plane, axes, origin, cell, size, filled, open })
    }

    /// Cell that a point lies over or under.
    pub(super) fn at(&self, p: Vec3) -> Option<usize> {
        self.index(self.cell_under(p).as_ivec2())
    }

    /// Column and row that a point lies over or under, on the grid or beside it.
    fn cell_under(&self, p: Vec3) -> Vec2 {
        (Vec2::from(self.axes.map(|axis| axis.dot(p - self.origin))) / self.cell).floor()
    }

    /// Column and row of a cell.
    fn column_and_row(&self, i: usize) -> IVec2 {
        IVec2::new(i as i32 % self.size.x, i as i32 / self.size.x)
    }

    /// Cell of a column and row; `None` beside the grid.
    fn index(&self, c: IVec2) -> Option<usize> {
        let inside = c.cmpge(IVec2::ZERO).all() && c.cmplt(self.size).all();
        inside.then(|| (c.y * self.size.x + c.x) as usize)
    }

    /// Whether a point lies over or under the part of the plane that is surface.
    pub(super) fn covers(&self, p: Vec3) -> bool {
        self.at(p).is_some_and(|i| self.filled[i])
    }

    /// Where the ray of a pixel meets the part of the plane that is surface, be it behind something else.
    pub(super) fn met(&self, view: &View, ray: Vec3) -> Option<Crossing> {
        crossing(&self.plane, view, ray).filter(|c| self.covers(c.at))
    }

    /// Sums of the squared differences by plane and by depth, and their number, per cell.
    fn sums(&self, rivals: &[Rivals]) -> Vec<[f32; 3]> {
        let mut sums = vec![[0.0f32; 3]; self.filled.len()];
        for r in rivals {
            if let Some(i) = self.at(r.at) {
                r.add_to(&mut sums[i]);
            }
        }
        sums
    }

    /// Whether depth explains all of the sheet no better than the plane.
    pub(super) fn is_flat(&self, rivals: &[Rivals]) -> bool {
        let sums = self.sums(rivals);
        let of_plane = sums.iter().zip(&self.filled).filter(|(_, f)| **f);
        !is_uneven(
            of_plane.fold([0.0; 3], |t: [f32; 3], (s, _)| std::array::from_fn(|k| t[k] + s[k])),
        )
    }

    /// The sheet without the cells around which depth explains the photos better than the plane, its gaps and holes closed.
    pub(super) fn without_bumps(mut self, rivals: &[Rivals]) -> Self {
        let sums = self.sums_around(rivals);
        self.filled.iter_mut().zip(sums).for_each(|(filled, s)| *filled &= !is_uneven(s));
        self.close();
        self.fill_holes();
        self
    }

    /// Per cell, whether the plane explains the photos better than the depth of these patches around it.
    pub(super) fn is_better(&self, rivals: &[Rivals]) -> Vec<bool> {
        let better = |[by_plane, by_depth, n]: [f32; 3]| is_uneven([by_depth, by_plane, n]);
        self.sums_around(rivals).into_iter().map(better).collect()
    }

    /// The sheet with its gaps closed, and what things hide of it; wider openings that photos look through stay, such as windows.
    pub(super) fn with_openings(mut self) -> Self {
        self.close();
        let before = self.filled.clone();
        self.fill_holes();
        let cells = self.filled.iter_mut().zip(before).zip(&self.open);
        cells.for_each(|((filled, before), open)| *filled &= before || !open);
        self
    }

    /// [`Self::sums`] over the cells up to `BUMP_REACH` away.
    fn sums_around(&self, rivals: &[Rivals]) -> Vec<[f32; 3]> {
        let along_x = self.summed_along(&self.sums(rivals), IVec2::X);
        self.summed_along(&along_x, IVec2::Y)
    }

    /// Sums over the cells up to `BUMP_REACH` away along one axis.
    fn summed_along(&self, values: &[[f32; 3]], step: IVec2) -> Vec<[f32; 3]> {
        let of = |i| {
            let c = self.column_and_row(i);
            let mut sum = [0.0; 3];
            for q in (-BUMP_REACH..=BUMP_REACH).filter_map(|k| self.index(c + step * k)) {
                sum.iter_mut().zip(values[q]).for_each(|(s, v)| *s += v);
            }
            sum
        };
        (0..values.len()).map(of).collect()
    }

    /// Dilation, then erosion, by a square.
    fn close(&mut self) {
        for grow in [true, false] {
            for step in [IVec2::X, IVec2::Y] {
                let before = self.filled.clone();
                for i in 0..before.len() {
                    let c = self.column_and_row(i);
                    let at = |k| self.index(c + step * k);
                    if (-CLOSE..=CLOSE).any(|k| at(k).is_some_and(|q| before[q] == grow)) {
                        self.filled[i] = grow;
                    }
                }
            }
        }
    }

    /// Fills what the outside does not reach: things stand there.
    fn fill_holes(&mut self) {
        let is_rim = |i: usize| {
            let c = self.column_and_row(i);
            c.x == 0 || c.y == 0 || c.x == self.size.x - 1 || c.y == self.size.y - 1
        };
        let at_rim = (0..self.filled.len()).map(|i| !self.filled[i] && is_rim(i));
        let mut outside: Vec<bool> = at_rim.collect();
        let mut open: Vec<usize> = (0..outside.len()).filter(|i| outside[*i]).collect();
        while let Some(i) = open.pop() {
            let c = self.column_and_row(i);
            for step in [IVec2::X, IVec2::Y, IVec2::NEG_X, IVec2::NEG_Y] {
                let Some(k) = self.index(c + step) else { continue };
                if !outside[k] && !self.filled[k] {
                    outside[k] = true;
                    open.push(k);
                }
            }
        }
        self.filled = outside.iter().map(|o| !o).collect();
    }

    /// Puts the depth of pixels that see the sheet, or something behind it, onto it. Returns which do.
    pub(super) fn flatten(
        &self,
        view: &View,
        map: &mut DepthMap,
        tolerance: f32,
        voxel: f32,
    ) -> Vec<bool> {
        let width = view.width;
        let of = |(i, z): (usize, &mut f32)| {
            let ray = view.pixel_ray([i % width, i / width]);
            let Some(c) = crossing(&self.plane, view, ray) else { return false };
            let (on, through) = verdict(&self.plane, view, &c, ray, *z, tolerance, voxel);
            let flat = (on || through) && self.covers(c.at);
            if flat {
                *z = c.depth;
            }
            flat
        };
        map.depth.iter_mut().enumerate().map(of).collect()
    }

    /// The filled cells as triangles, up to a smooth outline: the rims of cells would show as steps in every shadow that the plane casts.
    pub(super) fn mesh(&self) -> Mesh {
        let on_plane = |[x, y]: [f32; 2]| {
            let p = self.origin + (self.axes[0] * x + self.axes[1] * y) * self.cell;
            p - self.plane.normal * self.plane.height(p)
        };
        let (points, triangles) =
            contour::filled([self.size.x as usize, self.size.y as usize], &self.filled);
        Mesh { vertices: points.into_iter().map(on_plane).collect(), triangles }
    }
}

/// Whether a pixel with depth `z` sees the plane, and whether it looks through it.
fn verdict(
    plane: &Plane,
    view: &View,
    c: &Crossing,
    ray: Vec3,
    z: f32,
    tolerance: f32,
    voxel: f32,
) -> (bool, bool) {
    if !(z > 0.0) {
        return (false, false);
    }
    let reach = reach(tolerance, z * view.footprint(), voxel);
    let height = plane.height(view.center + ray * z);
    (height.abs() <= reach, height < -reach && z > c.depth)
}

fn bounds(points: impl Iterator<Item = Vec2>) -> Option<(Vec2, Vec2)> {
    // The outermost thousandth does not count: single pixels at the horizon would stretch the grid.
    let (mut xs, mut ys): (Vec<f32>, Vec<f32>) =
        points.filter(|p| p.is_finite()).map(|p| (p.x, p.y)).unzip();
    if xs.is_empty() {
        return None;
    }
    xs.sort_unstable_by(f32::total_cmp);
    ys.sort_unstable_by(f32::total_cmp);
    let (low, high) = (xs.len() / 1000, xs.len() - 1 - xs.len() / 1000);
    Some((Vec2::new(xs[low], ys[low]), Vec2::new(xs[high], ys[high])))
}
