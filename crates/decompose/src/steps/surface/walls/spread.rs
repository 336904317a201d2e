//! The rest of a wall: Gaussians that hang before it and look like it from everywhere.
//!
//! A wall is found in the few photos whose depth agrees. In the others its pixels may lie up to a tenth of the distance before it,
//! in pieces as large as the photo, so no look at neighbors of the same photo puts them down. Other photos do: where the wall is known,
//! they show the brightness that belongs to each place of it. A pixel whose brightness they show on the wall no worse than at the
//! pixel's depth is wall. What stands before the wall moves against it from photo to photo, and only its own depth explains it.

use glam::Vec3;
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
            let photos = Photos { plane: &wall.plane, others: &[], views, maps, voxel };
            let showing = regions.iter().zip(&shows).filter(|(_, shows)| **shows);
            let on_wall = photos.on_wall(showing.map(|(region, _)| *region));
            let hanging = |region: &&Region| photos.hanging(region, &on_wall, None);
            let found: Vec<_> = regions.par_iter().with_max_len(1).map(hanging).collect();
            for (shows, put) in shows.iter_mut().zip(&found) {
                *shows |= !put.is_empty();
            }
            if !put_down(&found, regions, maps) {
                break;
            }
        }
    }
}

/// Puts the rest of regions in which walls go on onto the first of them on each ray, also where all photos hang before it: there, it is
/// enough that what they show in such regions explains it as well as the depth does.
pub(in crate::steps::surface) fn spread_to_rest(
    planes: &[Plane],
    regions: &[Region],
    views: &[View],
    maps: &mut [DepthMap],
    voxel: f32,
) {
    for plane in planes {
        for _ in 0..ROUNDS {
            let photos = Photos { plane, others: planes, views, maps, voxel };
            let goes_on = |region: &&Region| photos.goes_on(region);
            let regions: Vec<&Region> =
                regions.par_iter().with_max_len(1).filter(goes_on).collect();
            let on_wall = photos.on_wall(regions.iter().copied());
            let alike = photos.marked(regions.iter().copied(), |_, _| true);
            let hanging = |region: &&Region| photos.hanging(region, &on_wall, Some(&alike));
            let found: Vec<_> = regions.par_iter().with_max_len(1).map(hanging).collect();
            if !put_down(&found, &regions, maps) {
                break;
            }
        }
    }
}

/// Whether there was anything to put down.
fn put_down(found: &[Vec<(usize, f32)>], regions: &[&Region], maps: &mut [DepthMap]) -> bool {
    for (region, put) in regions.iter().zip(found) {
        put.iter().for_each(|&(i, z)| maps[region.view].depth[i] = z);
    }
    found.iter().any(|put| !put.is_empty())
}

/// A wall before the photos.
struct Photos<'a> {
    plane: &'a Plane,
    /// Walls that a pixel may show instead.
    others: &'a [Plane],
    views: &'a [View],
    maps: &'a [DepthMap],
    voxel: f32,
}

/// Per photo, which of its pixels tell.
type Telling = [Vec<bool>];

/// What other photos say of the pixels of a region, every `STRIDE`-th: mean differences of brightness, NaN where no photo says anything.
pub(super) struct Compared {
    width: usize,
    height: usize,
    by_wall: Vec<f32>,
    by_depth: Vec<f32>,
    /// 1 where another photo tells something of the place, 0 where none does.
    shown: Vec<f32>,
}

/// What explains other photos around a pixel.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Explanation {
    Wall,
    Depth,
    Either,
}

impl Photos<'_> {
    fn lies_on_wall(&self, view: usize, i: usize) -> bool {
        Place::new(&self.views[view], &self.maps[view], i, self.voxel).lies_on(self.plane)
    }

    /// Per photo, the pixels of regions that lie on the wall.
    fn on_wall<'r>(&self, regions: impl Iterator<Item = &'r Region>) -> Vec<Vec<bool>> {
        self.marked(regions, |k, i| self.lies_on_wall(k, i))
    }

    /// Per photo, the pixels of regions that are asked for by photo and pixel.
    fn marked<'r>(
        &self,
        regions: impl Iterator<Item = &'r Region>,
        is: impl Fn(usize, usize) -> bool,
    ) -> Vec<Vec<bool>> {
        let none = |view: &View| vec![false; view.width * view.height];
        let mut marked: Vec<Vec<bool>> = self.views.iter().map(none).collect();
        for region in regions {
            for i in region.pixels.iter().map(|&i| i as usize) {
                marked[region.view][i] = is(region.view, i);
            }
        }
        marked
    }

    /// The pixels of a region that hang before the wall, with their depth on it. What no photo tells by the pixels `on_wall`, they tell
    /// by those that are `alike`, as far as nothing there stands before the wall.
    fn hanging(
        &self,
        region: &Region,
        on_wall: &Telling,
        alike: Option<&Telling>,
    ) -> Vec<(usize, f32)> {
        let (view, map) = (&self.views[region.view], &self.maps[region.view]);
        if !(self.plane.height(view.center) > 0.0) {
            return Vec::new();
        }
        let differences = |i| self.differences(region.view, i, on_wall, alike);
        let compared = Compared::of(region, view, differences);
        if !compared.shown.contains(&1.0) {
            return Vec::new();
        }
        // Photos tell by what is alike of regions in which the wall goes on only.
        let goes_on = alike.is_some() || self.goes_on(region);
        let explained = compared.explained(if goes_on { ALIKE } else { BETTER });
        let of = |i: usize| {
            let at = [i % view.width, i / view.width];
            let z = self.plane.depth(view, view.pixel_ray(at))?;
            let hangs = map.depth[i] < z && map.depth[i] >= (1.0 - MOST_RISE) * z;
            let is_wall = explained[compared.cell(at)] == Explanation::Wall;
            let is_put = hangs && is_wall && self.is_first(view, at, z);
            is_put.then_some((i, z))
        };
        region.pixels.iter().filter_map(|&i| of(i as usize)).collect()
    }

    fn goes_on(&self, region: &Region) -> bool {
        let held = region.pixels.iter().filter(|&&i| self.lies_on_wall(region.view, i as usize));
        held.count() as f32 >= HELD * region.pixels.len() as f32
    }

    /// Whether the ray of a pixel meets no other wall before the depth `z` of this one.
    fn is_first(&self, view: &View, at: [usize; 2], z: f32) -> bool {
        let ray = view.pixel_ray(at);
        let before = |other: &Plane| other.depth(view, ray).is_some_and(|other| other < z);
        !self.others.iter().any(before)
    }

    /// Mean differences between the brightness of a pixel and what the photos that tell have at its place on the wall, and at its depth.
    fn differences(
        &self,
        k: usize,
        i: usize,
        on_wall: &Telling,
        alike: Option<&Telling>,
    ) -> Option<[f32; 2]> {
        let view = &self.views[k];
        let at = [i % view.width, i / view.width];
        let z = self.plane.depth(view, view.pixel_ray(at))?;
        let places = [z, self.maps[k].depth[i]].map(|z| view.place(at, z));
        let on_wall = |j: usize, pixel: usize, _| on_wall[j][pixel];
        self.mean_differences((k, i), places, on_wall).or_else(|| {
            let stands =
                |j: usize, pixel: usize, z| self.maps[j].depth[pixel] < (1.0 - MOST_RISE) * z;
            let alike = alike?;
            let tells = |j: usize, pixel: usize, z| alike[j][pixel] && !stands(j, pixel, z);
            self.mean_differences((k, i), places, tells)
        })
    }

    /// The same over the photos of which `tells` says yes, from photo, pixel and the distance of the place on the wall.
    fn mean_differences(
        &self,
        (k, i): (usize, usize),
        places: [Vec3; 2],
        tells: impl Fn(usize, usize, f32) -> bool,
    ) -> Option<[f32; 2]> {
        let own = self.views[k].luma[i];
        let (mut sums, mut count) = ([0.0f32; 2], 0.0f32);
        for (j, other) in self.views.iter().enumerate().filter(|&(j, _)| j != k) {
            let Some(q) = other.project(places[0]) else { continue };
            if !other.pixel(q.x, q.y).is_some_and(|pixel| tells(j, pixel, q.z)) {
                continue;
            }
            let Some((by_wall, _)) = other.luma_at(q.x, q.y) else { continue };
            let at_depth = other.project(places[1]).and_then(|q| other.luma_at(q.x, q.y));
            // What the other photo would have to show outside of itself is not explained.
            let by_depth = at_depth.map_or(1.0, |(luma, _)| luma);
            sums[0] += (by_wall - own).abs();
            sums[1] += (by_depth - own).abs();
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

    /// What explains other photos around each compared pixel: the wall, where it leaves at most `limit` times the difference that
    /// depth leaves and no pixel beside says otherwise, and depth, where the wall leaves more than that.
    pub(super) fn explained(&self, limit: f32) -> Vec<Explanation> {
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
        let of = |k: usize| match (explains(&wall, &depth, k, limit), shown[k] >= SHOWN) {
            (false, _) => Explanation::Depth,
            (true, true) if against[k] == 0.0 => Explanation::Wall,
            (true, _) => Explanation::Either,
        };
        (0..shown.len()).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_that_no_photo_shows_speaks_neither_for_the_wall_nor_against_it() {
        // Blocks of ten: the wall explains the photos, depth does, both do, and no photo shows the place.
        let block = |v: [f32; 4]| v.into_iter().flat_map(|v| [v; 10]).collect::<Vec<f32>>();
        let compared = Compared {
            width: 40,
            height: 1,
            by_wall: block([0.01, 0.05, 0.01, f32::NAN]),
            by_depth: block([0.03, 0.01, 0.01, f32::NAN]),
            shown: block([1.0, 1.0, 1.0, 0.0]),
        };
        let explained = compared.explained(1.0);
        assert!(explained[5] == Explanation::Wall);
        assert!(explained[15] == Explanation::Depth);
        assert!(explained[25] == Explanation::Wall);
        assert!(explained[35] == Explanation::Either);
    }
}
