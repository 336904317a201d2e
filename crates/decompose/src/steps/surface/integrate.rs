//! One block of the signed distance, view after view, eight voxels at a time.

use fearless_simd::{Simd, dispatch, f32x8, prelude::*};
use glam::{IVec3, Vec3};
use half::f16;

use super::silhouettes::Silhouette;
use super::simd::level;
use super::splat_depth::DepthMap;
use super::tsdf::{Block, SIDE, TRUNCATION, VOXELS};
use super::view::View;

/// Neighboring pixels whose depths differ by more than this many footprints see two things.
const STEP: f32 = 8.0;

/// Weight of what the silhouettes leave over, against 1 of a depth; less where depths tell, none where they have this.
const HULL_WEIGHT: f32 = 0.3;
const TOLD: f32 = 2.0;
/// Views that must have a place in their picture for silhouettes to tell about it: this many, and one in this many.
const HULL_VIEWS: usize = 4;
const HULL_SHARE: usize = 2;

/// What blocks are made of.
pub(super) struct Seen<'a> {
    pub(super) views: &'a [View],
    pub(super) maps: &'a [DepthMap],
    /// Per view, or empty.
    pub(super) hull: &'a [Silhouette],
    /// Edge, unit world.
    pub(super) voxel: f32,
    /// Weight of a view that sees through a voxel.
    pub(super) carve: f32,
}

/// A row of voxels, along x.
type Row = [f32; SIDE];

/// A block while views are added to it.
struct Sums {
    distance: [Row; SIDE * SIDE],
    /// 0 where nothing was seen.
    weight: [Row; SIDE * SIDE],
    /// Views within the truncation.
    near: [Row; SIDE * SIDE],
    /// Depth inside of the silhouettes, the least of all views, and the number of these.
    inside: [Row; SIDE * SIDE],
    looks: [Row; SIDE * SIDE],
}

/// What a view says about a row: 0 where nothing.
#[derive(Default)]
struct Looked {
    /// Four depths around each voxel, and how far it lies from the first to the others.
    corners: [Row; 4],
    fractions: [Row; 2],
    nearest: Row,
    steady: Row,
    within: Row,
}

impl Seen<'_> {
    pub(super) fn integrate(&self, key: IVec3) -> Block {
        dispatch!(level(), simd => self.integrate_on(simd, key))
    }

    #[inline(always)]
    fn integrate_on<S: Simd>(&self, simd: S, key: IVec3) -> Block {
        let none = [[0.0; SIDE]; SIDE * SIDE];
        let far = [[TRUNCATION; SIDE]; SIDE * SIDE];
        let mut sums = Sums { distance: far, weight: none, near: none, inside: far, looks: none };
        let edge = self.voxel * SIDE as f32;
        let corner = key.as_vec3() * edge;
        for (k, view) in self.views.iter().enumerate() {
            if view.may_show(corner + 0.5 * edge, 0.87 * edge) {
                self.add(simd, k, corner, &mut sums);
            }
        }
        self.fill_hull(&mut sums);
        sums.block()
    }

    /// Adds view `k`.
    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, k: usize, corner: Vec3, sums: &mut Sums) {
        let view = &self.views[k];
        let first = view.image_of(corner - view.center);
        let [along, up, out] = Vec3::AXES.map(|axis| view.image_of(axis * self.voxel));
        let steps: Row = std::array::from_fn(|i| i as f32);
        let steps = f32x8::from_slice(simd, &steps);
        let (right, bottom) = (view.width as f32, view.height as f32);
        for row in 0..SIDE * SIDE {
            let h = first + up * (row % SIDE) as f32 + out * (row / SIDE) as f32;
            let z = steps * along.z + h.z;
            let (x, y) = ((steps * along.x + h.x) / z, (steps * along.y + h.y) / z);
            let shown = z.simd_gt(1e-6)
                & x.simd_ge(0.0)
                & y.simd_ge(0.0)
                & x.simd_lt(right)
                & y.simd_lt(bottom);
            if !shown.any_true() {
                continue;
            }
            let outside = f32x8::splat(simd, -1.0);
            let mut at = [[0.0; SIDE]; 2];
            shown.select(x, outside).store_slice(&mut at[0]);
            shown.select(y, outside).store_slice(&mut at[1]);
            let looked = self.look(k, &at);
            let load = |values: &Row| f32x8::from_slice(simd, values);
            let zero = f32x8::splat(simd, 0.0);
            if self.has_outlines() {
                // From the center of the last pixel inside to the outline is half a pixel.
                let scale = view.footprint() / self.voxel;
                let within = (load(&looked.within) - 0.5) * z * scale;
                let inside = load(&sums.inside[row]);
                shown.select(inside.min(within), inside).store_slice(&mut sums.inside[row]);
                let tells = shown & within.simd_lt(f32x8::splat(simd, f32::INFINITY));
                let more = tells.select(f32x8::splat(simd, 1.0), zero);
                (load(&sums.looks[row]) + more).store_slice(&mut sums.looks[row]);
            }
            let [a, b, c, d] = [0, 1, 2, 3].map(|k: usize| load(&looked.corners[k]));
            let [u, v] = [0, 1].map(|k: usize| load(&looked.fractions[k]));
            let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
            let nearest = load(&looked.nearest);
            // At a step half a pixel decides what is in front.
            let even = (high - low).simd_lt(nearest * (STEP * view.footprint()));
            let (top, under) = (a + (b - a) * u, c + (d - c) * u);
            let depth = top + (under - top) * v;
            let distance = (depth - z) / self.voxel;
            // A depth is as uncertain as a pixel is wide.
            let sure = f32x8::splat(simd, self.voxel) / (depth * view.footprint());
            let is_near = distance.simd_lt(TRUNCATION);
            let carve = is_near.select(f32x8::splat(simd, 1.0), f32x8::splat(simd, self.carve));
            let weight = (sure * sure).min(1.0) * load(&looked.steady) * carve;
            let told =
                nearest.simd_gt(0.0) & even & distance.simd_gt(-TRUNCATION) & weight.simd_gt(0.0);
            if !told.any_true() {
                continue;
            }
            let (before, known) = (load(&sums.distance[row]), load(&sums.weight[row]));
            let after = (before * known + distance.min(TRUNCATION) * weight) / (known + weight);
            told.select(after, before).store_slice(&mut sums.distance[row]);
            told.select(known + weight, known).store_slice(&mut sums.weight[row]);
            let near = load(&sums.near[row]);
            (told & is_near).select(near + 1.0, near).store_slice(&mut sums.near[row]);
        }
    }

    /// Looks up eight places in view `k`; those outside are below 0.
    #[inline(always)]
    fn look(&self, k: usize, [x, y]: &[Row; 2]) -> Looked {
        let (view, depth) = (&self.views[k], &self.maps[k].depth);
        let mut out = Looked { steady: [1.0; SIDE], ..Looked::default() };
        for i in 0..SIDE {
            let (x, y) = (x[i], y[i]);
            if !(x >= 0.0) {
                continue;
            }
            let pixel = y as usize * view.width + x as usize;
            if let Some(hull) = self.hull.get(k) {
                out.steady[i] = hull.steady[pixel];
                out.within[i] = hull.depth_inside.get(pixel).copied().unwrap_or(0.0);
            }
            let nearest = depth[pixel];
            out.nearest[i] = nearest;
            out.corners.iter_mut().for_each(|c| c[i] = nearest);
            let (u, v) = (x - 0.5, y - 0.5);
            // Along the rim there is nothing to interpolate between.
            let (right, bottom) = ((view.width - 1) as f32, (view.height - 1) as f32);
            if !(u >= 0.0 && v >= 0.0 && u < right && v < bottom) {
                continue;
            }
            let (column, row) = (u as usize, v as usize);
            (out.fractions[0][i], out.fractions[1][i]) = (u - column as f32, v - row as f32);
            let first = row * view.width + column;
            let (top, under) = (&depth[first..], &depth[first + view.width..]);
            (out.corners[0][i], out.corners[1][i]) = (top[0], top[1]);
            (out.corners[2][i], out.corners[3][i]) = (under[0], under[1]);
        }
        out
    }

    fn has_outlines(&self) -> bool {
        self.hull.first().is_some_and(Silhouette::has_outline)
    }

    /// Puts what the silhouettes leave over where depths tell little.
    fn fill_hull(&self, sums: &mut Sums) {
        if !self.has_outlines() {
            return;
        }
        let least = (self.views.len() / HULL_SHARE).max(HULL_VIEWS) as f32;
        for row in 0..SIDE * SIDE {
            for i in 0..SIDE {
                let within = sums.inside[row][i];
                if !(within > 0.0 && sums.looks[row][i] >= least) {
                    continue;
                }
                let (distance, weight) = (&mut sums.distance[row][i], &mut sums.weight[row][i]);
                let w = HULL_WEIGHT * (1.0 - *weight / TOLD);
                if !(w > 0.0) {
                    continue;
                }
                if w > *weight {
                    sums.near[row][i] = f32::from(u8::MAX);
                }
                *distance = (*distance * *weight - within * w) / (*weight + w);
                *weight += w;
            }
        }
    }
}

impl Sums {
    fn block(&self) -> Block {
        let mut block = Block { distance: [f16::NAN; VOXELS], seen: [0; VOXELS] };
        for i in 0..VOXELS {
            let (row, column) = (i / SIDE, i % SIDE);
            if self.weight[row][column] > 0.0 {
                block.distance[i] = f16::from_f32(self.distance[row][column]);
            }
            // Saturates.
            block.seen[i] = self.near[row][column] as u8;
        }
        block
    }
}

#[cfg(test)]
mod tests;
