//! How well places explain what other photos show (photo-consistency).

use glam::Vec3;
use motes_math::median::upper_median;
use rayon::prelude::*;

use super::Region;
use crate::steps::surface::planes::Plane;
use crate::steps::surface::silhouettes::blurred;
use crate::steps::surface::splat_depth::DepthMap;
use crate::steps::surface::view::View;

/// Side of the square that brightness is averaged over, pixels: a bare wall tells its place by shading, and its grain is noise.
const WINDOW: usize = 5;
/// Photos that a photo is compared with: those whose sight is turned most nearly by this angle, radians.
const PARTNERS: usize = 8;
const TURN: f32 = 0.4;
/// A larger difference of brightness says no more (raised to 1/2.2, 0 to 1). Two photos as wholes may differ by as much.
const MOST_DIFFERENCE: f32 = 0.04;
/// Share of the distance by which something must be nearer than a place to hide it: what hangs before a wall by less may be the wall.
const HIDING: f32 = 0.15;
/// Places that a photo must show.
const LEAST_PLACES: usize = 20;

/// A pixel of a photo, and where it may be in the unit world.
pub(super) type Place = (u32, Vec3);

/// Mean difference of brightness, and the number of comparisons it is of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cost {
    pub(super) mean: f32,
    pub(super) count: usize,
}

/// Photos as places are judged by.
pub(super) struct Photos<'a> {
    pub(super) views: &'a [View],
    pub(super) maps: &'a [DepthMap],
    /// Per photo, `[h, w]`, its averaged brightness,
    shades: &'a [Vec<f32>],
    /// and those it is compared with.
    partners: Vec<Vec<usize>>,
}

/// The averaged brightness of photos.
pub(super) fn shades(views: &[View]) -> Vec<Vec<f32>> {
    let shade = |v: &View| blurred(&v.luma, v.width, v.height, WINDOW);
    views.par_iter().with_max_len(1).map(shade).collect()
}

impl<'a> Photos<'a> {
    pub(super) fn new(views: &'a [View], maps: &'a [DepthMap], shades: &'a [Vec<f32>]) -> Self {
        let partners = (0..views.len()).map(|i| partners(i, views, &maps[i])).collect();
        Self { views, maps, shades, partners }
    }

    /// What places of photo `i` leave unexplained of its partners; `None` where no partner shows them.
    pub(super) fn cost(&self, i: usize, places: &[Place]) -> Option<Cost> {
        let own = &self.shades[i];
        let (mut sum, mut count) = (0.0, 0);
        let mut differences = Vec::with_capacity(places.len());
        for &j in &self.partners[i] {
            let difference = |&(k, at): &Place| Some(own[k as usize] - self.shade(j, at)?);
            differences.clear();
            differences.extend(places.iter().filter_map(difference));
            if differences.len() < LEAST_PLACES {
                continue;
            }
            // Photos differ in exposure by a little, and in vignetting.
            let middle = upper_median(&mut differences, f32::total_cmp)?;
            let middle = middle.clamp(-MOST_DIFFERENCE, MOST_DIFFERENCE);
            sum += differences.iter().map(|d| (d - middle).abs().min(MOST_DIFFERENCE)).sum::<f32>();
            count += differences.len();
        }
        (count > 0).then(|| Cost { mean: sum / count as f32, count })
    }

    /// Mean differences of a pixel of photo `i` at two places, over the partners that show both.
    pub(super) fn rivals(&self, i: usize, pixel: usize, places: [Vec3; 2]) -> Option<[f32; 2]> {
        let (mut sums, mut count) = ([0.0; 2], 0.0);
        for &j in &self.partners[i] {
            if let [Some(a), Some(b)] = places.map(|at| self.shade(j, at)) {
                let differences = [a, b].map(|s| (s - self.shades[i][pixel]).abs());
                sums.iter_mut().zip(differences).for_each(|(s, d)| *s += d.min(MOST_DIFFERENCE));
                count += 1.0;
            }
        }
        (count > 0.0).then(|| sums.map(|s| s / count))
    }

    /// What photo `j` shows at a place: `None` outside of the picture, and behind something.
    fn shade(&self, j: usize, place: Vec3) -> Option<f32> {
        let (view, map) = (&self.views[j], &self.maps[j]);
        let q = view.project(place)?;
        let z = map.depth[view.pixel(q.x, q.y)?];
        let is_hidden = z > 0.0 && z < (1.0 - HIDING) * q.z;
        let (shade, weight) = view.between(&self.shades[j], q.x, q.y)?;
        (!is_hidden && weight > 0.5).then_some(shade)
    }

    /// What the depth of a region leaves unexplained.
    pub(super) fn by_depth(&self, region: &Region) -> Option<Cost> {
        let (view, map) = (&self.views[region.view], &self.maps[region.view]);
        let place = |k: u32| (k, view.place(view.at(k), map.depth[k as usize]));
        self.cost(region.view, &region.looked_at().map(place).collect::<Vec<_>>())
    }

    /// What a plane leaves unexplained of a region.
    pub(super) fn by_plane(&self, region: &Region, plane: &Plane) -> Option<Cost> {
        self.cost(region.view, &self.on_plane(region, plane))
    }

    /// [`Self::by_plane`] after the plane is moved by a share of its distance from the camera.
    pub(super) fn by_moved(&self, region: &Region, plane: &Plane, share: f32) -> Option<Cost> {
        let by = share * plane.height(self.views[region.view].center);
        self.by_plane(region, &Plane { offset: plane.offset - by, ..*plane })
    }

    /// Where the pixels of a region see a plane; those that look past its front are left out.
    pub(super) fn on_plane(&self, region: &Region, plane: &Plane) -> Vec<Place> {
        let view = &self.views[region.view];
        let place = |k: u32| {
            let at = view.at(k);
            Some((k, view.place(at, plane.depth(view, view.pixel_ray(at))?)))
        };
        region.looked_at().filter_map(place).collect()
    }
}

/// The photos that see the middle of photo `i` from another side.
fn partners(i: usize, views: &[View], map: &DepthMap) -> Vec<usize> {
    let view = &views[i];
    let Some(seen) = view.middle(map) else { return Vec::new() };
    let turned = |j: usize| {
        let turn = (view.center - seen).angle_between(views[j].center - seen);
        ((turn - TURN).abs(), j)
    };
    let mut ranked: Vec<(f32, usize)> = (0..views.len()).filter(|&j| j != i).map(turned).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ranked.into_iter().take(PARTNERS).map(|(_, j)| j).collect()
}
