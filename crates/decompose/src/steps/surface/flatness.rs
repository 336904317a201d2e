//! Which planes the photos know for flat.
//!
//! A crumpled blanket lies within the tolerance of a plane, and so does noisy depth on a table. The photos tell them apart: what one of
//! them shows is carried into others, over the plane and over the depth of the Gaussians. On a table the plane carries it better, or
//! there is no texture and both carry it alike. Where depth does, the ground is uneven.

use glam::Vec3;
use rayon::prelude::*;

use super::planes::{Plane, reach};
use super::splat_depth::DepthMap;
use super::view::View;

mod fit;

pub(super) use fit::fitted;

/// Pixels between the patches that are compared.
pub(super) const STRIDE: usize = 3;
/// Samples along the side of a patch, odd, and pixels between them.
const SIDE: usize = 5;
const SPACING: usize = 2;
const RIM: usize = SIDE / 2 * SPACING;
/// Samples of a patch that the other photo must show.
const LEAST_SAMPLES: usize = SIDE * SIDE / 2;
/// Photos that a patch is carried into: those whose sight is turned most nearly by this angle, radians.
const PARTNERS: usize = 4;
const TURN: f32 = 0.25;
/// A place that something nearer than this many voxels hides is not seen.
const HIDDEN: f32 = 6.0;
/// Pixels beside one that must be as visible: edges are blurred, so what stands beside a place shines into it.
const BESIDE: [[f32; 2]; 4] = [[-1.5, 0.0], [1.5, 0.0], [0.0, -1.5], [0.0, 1.5]];
/// What rises so many tolerances over a plane stands before it.
const CLEAR: f32 = 2.0;
/// A larger squared difference says no more (brightness raised to 1/2.2, 0 to 1).
const MOST_DIFFERENCE: f32 = 0.01;

/// The photos of a capture as planes are judged by.
pub(super) struct Witnesses<'a> {
    views: &'a [View],
    maps: &'a [DepthMap],
    /// Per photo, those it is compared with.
    partners: Vec<Vec<usize>>,
    /// Distance from a plane at which a pixel of the size of a voxel lies on it, unit world.
    tolerance: f32,
    voxel: f32,
}

/// One patch: where it lies on the plane, and the mean squared differences that plane and depth leave.
pub(super) struct Rivals {
    pub(super) at: Vec3,
    pub(super) by_plane: f32,
    pub(super) by_depth: f32,
}

impl Rivals {
    /// Adds to sums by plane and by depth, and to their number.
    pub(super) fn add_to(&self, sums: &mut [f32; 3]) {
        let add = [self.by_plane, self.by_depth, 1.0];
        sums.iter_mut().zip(add).for_each(|(s, a)| *s += a);
    }
}

/// A plane is uneven when it leaves so many times the squared difference that depth leaves. Noise of brightness, 0 to 1.
const BUMP: f32 = 1.1;
const NOISE: f32 = 0.5 / 255.0;

/// Whether a plane leaves more of the squared differences than depth does; sums by plane and by depth, and their number.
pub(super) fn is_uneven([by_plane, by_depth, count]: [f32; 3]) -> bool {
    by_plane > BUMP * by_depth + NOISE * NOISE * count
}

/// Places that the samples of a patch see, with their brightness.
type Patch = [(Vec3, f32); SIDE * SIDE];

impl<'a> Witnesses<'a> {
    pub(super) fn new(views: &'a [View], maps: &'a [DepthMap], tolerance: f32, voxel: f32) -> Self {
        let partners = (0..views.len()).map(|i| partners(i, views, &maps[i])).collect();
        Self { views, maps, partners, tolerance, voxel }
    }

    /// Compares a plane with the depth of the patches that lie on it.
    pub(super) fn rivals(&self, plane: &Plane) -> Vec<Rivals> {
        self.compare(plane, &self.held(plane, STRIDE), &[[0.0; 2]])
    }

    /// Compares a plane with the depth of the patches around `pixels`, per photo. A sample counts where nothing hides the pixels `around` its own
    /// from the other photo.
    pub(super) fn compare(
        &self,
        plane: &Plane,
        pixels: &[Vec<[usize; 2]>],
        around: &[[f32; 2]],
    ) -> Vec<Rivals> {
        let of = |i: usize| {
            let compared = pixels[i].iter().filter_map(|&at| self.compared(plane, i, at, around));
            compared.collect::<Vec<_>>()
        };
        let all: Vec<_> = (0..pixels.len()).into_par_iter().with_max_len(1).map(of).collect();
        all.into_iter().flatten().collect()
    }

    /// Compares a plane with the depth of the patch around a pixel of photo `i`; `None` where no other photo shows it.
    fn compared(
        &self,
        plane: &Plane,
        i: usize,
        at: [usize; 2],
        around: &[[f32; 2]],
    ) -> Option<Rivals> {
        let [on_plane, on_depth] = self.patches(plane, i, at)?;
        let (mut by_plane, mut by_depth, mut count) = (0.0, 0.0, 0.0);
        for &j in &self.partners[i] {
            let Some(a) = self.difference(&on_plane, j, around) else { continue };
            let Some(b) = self.difference(&on_depth, j, around) else { continue };
            by_plane += a;
            by_depth += b;
            count += 1.0;
        }
        let at = on_plane[on_plane.len() / 2].0;
        let mean = |sum: f32| sum / count;
        (count > 0.0).then(|| Rivals { at, by_plane: mean(by_plane), by_depth: mean(by_depth) })
    }

    /// Whether the depth of these pixels of photo `i`, every `STRIDE`-th of them, explains the other photos no better than the plane. Patches count
    /// that lie whole among the pixels.
    pub(super) fn is_flat(&self, plane: &Plane, i: usize, pixels: impl Fn(usize) -> bool) -> bool {
        let (width, height) = (self.views[i].width, self.views[i].height);
        let (rows, columns) = (RIM..height.saturating_sub(RIM), RIM..width.saturating_sub(RIM));
        let mut sums = [0.0; 3];
        for y in rows.step_by(STRIDE) {
            for x in columns.clone().step_by(STRIDE) {
                if !patch_pixels([x, y]).all(|[x, y]| pixels(y * width + x)) {
                    continue;
                }
                if let Some(r) = self.compared(plane, i, [x, y], &BESIDE) {
                    r.add_to(&mut sums);
                }
            }
        }
        !is_uneven(sums)
    }

    /// What the photos that a place of photo `i` is compared with put in its direction.
    pub(super) fn seconds(&self, i: usize, place: Vec3) -> impl Iterator<Item = Vec3> + '_ {
        self.partners[i].iter().filter_map(move |&j| {
            let (view, map) = (&self.views[j], &self.maps[j]);
            let q = view.project(place)?;
            let z = map.depth[view.pixel(q.x, q.y)?];
            (z > 0.0).then(|| view.center + (place - view.center) * (z / q.z))
        })
    }

    /// Per photo, every `stride`-th pixel whose depth lies on the plane.
    fn held(&self, plane: &Plane, stride: usize) -> Vec<Vec<[usize; 2]>> {
        let of = |(view, map): (&View, &DepthMap)| {
            let mut held = inner_pixels(view, stride);
            held.retain(|&[x, y]| {
                let z = map.depth[y * view.width + x];
                let reach = reach(self.tolerance, z * view.footprint(), self.voxel);
                z > 0.0 && plane.height(view.place([x, y], z)).abs() <= reach
            });
            held
        };
        self.views.par_iter().zip(self.maps).with_max_len(1).map(of).collect()
    }

    /// Whether the patch around a pixel of photo `i` shows nothing that stands before the plane: its outline moves from photo to photo as
    /// a nearer plane would.
    fn is_clear(&self, plane: &Plane, i: usize, at: [usize; 2]) -> bool {
        let (view, map) = (&self.views[i], &self.maps[i]);
        patch_pixels(at).all(|pixel| {
            let z = map.depth[pixel[1] * view.width + pixel[0]];
            let reach = reach(self.tolerance, z * view.footprint(), self.voxel);
            z > 0.0 && plane.height(view.place(pixel, z)) <= CLEAR * reach
        })
    }

    /// The patch around a pixel of photo `i` on the plane, and at its depth; `None` where a sample has no depth.
    fn patches(&self, plane: &Plane, i: usize, at: [usize; 2]) -> Option<[Patch; 2]> {
        let (view, map) = (&self.views[i], &self.maps[i]);
        let mut patches = [[(Vec3::ZERO, 0.0); SIDE * SIDE]; 2];
        for (k, pixel) in patch_pixels(at).enumerate() {
            let at = pixel[1] * view.width + pixel[0];
            let z = map.depth[at];
            let ray = view.pixel_ray(pixel);
            let flat = plane.depth(view, ray)?;
            if !(z > 0.0 && view.weight(at) > 0.5) {
                return None;
            }
            for (patch, z) in patches.iter_mut().zip([flat, z]) {
                patch[k] = (view.center + ray * z, view.luma[at]);
            }
        }
        Some(patches)
    }

    /// Mean squared difference between a patch and what photo `j` shows in its place, without that of their means. A sample counts where
    /// nothing hides the pixels `around` its own.
    fn difference(&self, patch: &Patch, j: usize, around: &[[f32; 2]]) -> Option<f32> {
        let (view, map) = (&self.views[j], &self.maps[j]);
        let (mut sum, mut squares, mut count) = (0.0f32, 0.0f32, 0usize);
        for &(place, luma) in patch {
            let Some(q) = view.project(place) else { continue };
            let Some((shown, weight)) = view.luma_at(q.x, q.y) else { continue };
            if !(weight > 0.5) {
                continue;
            }
            let hides = |[x, y]: [f32; 2]| {
                let z = view.pixel(q.x + x, q.y + y).map_or(0.0, |k| map.depth[k]);
                z > 0.0 && z < q.z - HIDDEN * self.voxel
            };
            if around.iter().any(|&offset| hides(offset)) {
                continue;
            }
            let d = shown - luma;
            sum += d;
            squares += d * d;
            count += 1;
        }
        let n = count as f32;
        let variance = || (squares / n - (sum / n).powi(2)).clamp(0.0, MOST_DIFFERENCE);
        (count >= LEAST_SAMPLES).then(variance)
    }
}

/// Every `stride`-th pixel around which a patch fits, by rows.
pub(super) fn inner_pixels(view: &View, stride: usize) -> Vec<[usize; 2]> {
    let rows = (RIM..view.height.saturating_sub(RIM)).step_by(stride);
    let columns = (RIM..view.width.saturating_sub(RIM)).step_by(stride);
    rows.flat_map(|y| columns.clone().map(move |x| [x, y])).collect()
}

/// The pixels of the samples of a patch around a pixel, at least `RIM` inside of the photo.
fn patch_pixels([x, y]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    (0..SIDE * SIDE).map(move |k| [x + k % SIDE * SPACING - RIM, y + k / SIDE * SPACING - RIM])
}

/// The photos that see the middle of photo `i` from another side.
fn partners(i: usize, views: &[View], map: &DepthMap) -> Vec<usize> {
    let view = &views[i];
    let Some(seen) = view.middle(map) else { return Vec::new() };
    let turned = |j: usize| {
        let q = views[j].project(seen)?;
        views[j].pixel(q.x, q.y)?;
        let turn = (view.center - seen).angle_between(views[j].center - seen);
        Some(((turn - TURN).abs(), j))
    };
    let mut ranked: Vec<(f32, usize)> =
        (0..views.len()).filter(|&j| j != i).filter_map(turned).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ranked.into_iter().take(PARTNERS).map(|(_, j)| j).collect()
}

#[cfg(test)]
mod tests;
