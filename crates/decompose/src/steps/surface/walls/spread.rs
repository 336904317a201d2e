//! The rest of a wall: Gaussians that hang before it and look like it from everywhere.
//!
//! A wall is found in the few photos whose depth agrees. In the others its pixels may lie up to a tenth of the distance before it,
//! in pieces as large as the photo, so no look at neighbors of the same photo puts them down. Other photos do: where the wall is known,
//! they show the brightness that belongs to each place of it. A pixel whose brightness they show on the wall no worse than at the
//! pixel's depth is wall. What stands before the wall moves against it from photo to photo, and only its own depth explains it.

use rayon::prelude::*;

use super::{AROUND, Place, Region, Wall};
use crate::steps::surface::planes::Plane;
use crate::steps::surface::silhouettes::blurred;
use crate::steps::surface::splat_depth::DepthMap;
use crate::steps::surface::view::View;

/// Pixels between those that are compared.
const STRIDE: usize = 3;
/// Share of the compared pixels around one that another photo shows as wall.
const SHOWN: f32 = 0.5;
/// Distance before the wall, as a share of that from the camera, from which something stands there.
const MOST_RISE: f32 = 0.125;
/// Share of a region on the wall from which on the wall goes on under the rest of it.
const HELD: f32 = 0.03;
/// Difference that the wall may leave over that of the depth, where the wall goes on and elsewhere.
const ALIKE: f32 = 1.1;
const BETTER: f32 = 0.8;
/// Noise of brightness, 0 to 1.
const NOISE: f32 = 1.0 / 255.0;
/// Side of the square in which no compared pixel may be explained better by its depth: things are narrower than `AROUND`, and rims blurred.
const BESIDE: usize = 3;
/// Times that what was put onto the wall helps to put down more.
const ROUNDS: usize = 10;

/// Puts pixels of all regions that hang before a wall onto it, where other photos show it there.
pub(in crate::steps::surface) fn spread(
    walls: &[Wall],
    regions: &[&Region],
    views: &[View],
    maps: &mut [DepthMap],
    voxel: f32,
) {
    for wall in walls {
        let mut shows = vec![false; regions.len()];
        wall.regions.iter().for_each(|&i| shows[i] = true);
        for _ in 0..ROUNDS {
            let found: Vec<Vec<(usize, f32)>> = {
                let photos = Photos { plane: &wall.plane, views, maps, voxel };
                let on_wall = photos.on_wall(regions, &shows);
                let hanging = |region: &&Region| photos.hanging(region, &on_wall);
                regions.par_iter().with_max_len(1).map(hanging).collect()
            };
            for ((region, shows), put) in regions.iter().zip(&mut shows).zip(&found) {
                *shows |= !put.is_empty();
                put.iter().for_each(|&(i, z)| maps[region.view].depth[i] = z);
            }
            if found.iter().all(Vec::is_empty) {
                break;
            }
        }
    }
}

/// A wall before the photos.
struct Photos<'a> {
    plane: &'a Plane,
    views: &'a [View],
    maps: &'a [DepthMap],
    voxel: f32,
}

/// What other photos say of the pixels of a region, every `STRIDE`-th: mean differences of brightness, NaN where no photo says anything.
pub(super) struct Compared {
    width: usize,
    height: usize,
    by_wall: Vec<f32>,
    by_depth: Vec<f32>,
    /// 1 where another photo shows the place on the wall as wall, 0 where none does.
    shown: Vec<f32>,
}

impl Photos<'_> {
    fn lies_on_wall(&self, view: usize, i: usize) -> bool {
        Place::new(&self.views[view], &self.maps[view], i, self.voxel).lies_on(self.plane)
    }

    /// Per photo, the pixels of regions that show the wall and lie on it.
    fn on_wall(&self, regions: &[&Region], shows: &[bool]) -> Vec<Vec<bool>> {
        let none = |view: &View| vec![false; view.width * view.height];
        let mut on: Vec<Vec<bool>> = self.views.iter().map(none).collect();
        for (region, _) in regions.iter().zip(shows).filter(|(_, shows)| **shows) {
            for i in region.pixels.iter().map(|&i| i as usize) {
                on[region.view][i] = self.lies_on_wall(region.view, i);
            }
        }
        on
    }

    /// The pixels of a region that hang before the wall, with their depth on it.
    fn hanging(&self, region: &Region, on_wall: &[Vec<bool>]) -> Vec<(usize, f32)> {
        let (view, map) = (&self.views[region.view], &self.maps[region.view]);
        if !(self.plane.height(view.center) > 0.0) {
            return Vec::new();
        }
        let Some(compared) = self.compared(region, on_wall) else { return Vec::new() };
        let held = region.pixels.iter().filter(|&&i| self.lies_on_wall(region.view, i as usize));
        let goes_on = held.count() as f32 >= HELD * region.pixels.len() as f32;
        let is_wall = compared.is_wall(if goes_on { ALIKE } else { BETTER });
        let of = |i: usize| {
            let at = [i % view.width, i / view.width];
            let z = self.plane.depth(view, view.pixel_ray(at))?;
            let hangs = map.depth[i] < z && map.depth[i] >= (1.0 - MOST_RISE) * z;
            (hangs && is_wall[compared.cell(at)]).then_some((i, z))
        };
        region.pixels.iter().filter_map(|&i| of(i as usize)).collect()
    }

    /// `None` when no other photo shows any of it as wall.
    fn compared(&self, region: &Region, on_wall: &[Vec<bool>]) -> Option<Compared> {
        let differences = |i| self.differences(region.view, i, on_wall);
        let compared = Compared::of(region, &self.views[region.view], differences);
        compared.shown.contains(&1.0).then_some(compared)
    }

    /// Mean differences between the brightness of a pixel and what the photos that show its place on the wall as wall have there, and at
    /// its depth.
    fn differences(&self, k: usize, i: usize, on_wall: &[Vec<bool>]) -> Option<[f32; 2]> {
        let view = &self.views[k];
        let at = [i % view.width, i / view.width];
        let z = self.plane.depth(view, view.pixel_ray(at))?;
        let places = [z, self.maps[k].depth[i]].map(|z| view.place(at, z));
        let (mut sums, mut count) = ([0.0f32; 2], 0.0f32);
        for (j, (other, on)) in self.views.iter().zip(on_wall).enumerate() {
            let Some(q) = other.project(places[0]).filter(|_| j != k) else { continue };
            if !other.pixel(q.x, q.y).is_some_and(|pixel| on[pixel]) {
                continue;
            }
            let Some((by_wall, _)) = other.luma_at(q.x, q.y) else { continue };
            let at_depth = other.project(places[1]).and_then(|q| other.luma_at(q.x, q.y));
            // What the other photo would have to show outside of itself is not explained.
            let by_depth = at_depth.map_or(1.0, |(luma, _)| luma);
            sums[0] += (by_wall - view.luma[i]).abs();
            sums[1] += (by_depth - view.luma[i]).abs();
            count += 1.0;
        }
        (count > 0.0).then(|| sums.map(|s| s / count))
    }
}

impl Compared {
    fn new(view: &View) -> Self {
        let (width, height) = (view.width.div_ceil(STRIDE), view.height.div_ceil(STRIDE));
        let unknown = || vec![f32::NAN; width * height];
        Self { width, height, by_wall: unknown(), by_depth: unknown(), shown: unknown() }
    }

    /// The pixels of a region, with their differences by the wall and by depth.
    pub(super) fn of(
        region: &Region,
        view: &View,
        differences: impl Fn(usize) -> Option<[f32; 2]>,
    ) -> Self {
        let mut compared = Self::new(view);
        for &i in &region.pixels {
            let at = view.at(i);
            if at.iter().any(|v| v % STRIDE != STRIDE / 2) {
                continue;
            }
            let k = compared.cell(at);
            if let Some([by_wall, by_depth]) = differences(i as usize) {
                (compared.by_wall[k], compared.by_depth[k], compared.shown[k]) =
                    (by_wall, by_depth, 1.0);
            } else {
                compared.shown[k] = 0.0;
            }
        }
        compared
    }

    pub(super) fn cell(&self, [x, y]: [usize; 2]) -> usize {
        y / STRIDE * self.width + x / STRIDE
    }

    /// Where the wall leaves at most `limit` times the difference that depth leaves, and no pixel beside says otherwise.
    pub(super) fn is_wall(&self, limit: f32) -> Vec<bool> {
        let side = (AROUND * self.width.max(self.height) as f32) as usize | 1;
        let over = |values: &[f32], side| blurred(values, self.width, self.height, side);
        let explains = |wall: &[f32], depth: &[f32], k: usize, limit: f32| {
            // Where nothing is known, nothing speaks against the wall.
            !(wall[k] > limit * depth[k] + NOISE)
        };
        let against = |k: usize| !explains(&self.by_wall, &self.by_depth, k, ALIKE);
        let against: Vec<f32> = (0..self.shown.len()).map(|k| f32::from(against(k))).collect();
        let against = over(&against, BESIDE);
        let [wall, depth, shown] =
            [&self.by_wall, &self.by_depth, &self.shown].map(|values| over(values, side));
        let of =
            |k: usize| shown[k] >= SHOWN && explains(&wall, &depth, k, limit) && against[k] == 0.0;
        (0..shown.len()).map(of).collect()
    }
}
