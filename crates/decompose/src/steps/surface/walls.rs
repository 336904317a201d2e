//! The planes that bound a room: walls, doors of cupboards, a bare floor.
//!
//! The depth of Gaussians on a wall of one color is wrong by a tenth of the distance here and right there, so no search among single
//! pixels finds the wall. A region of one brightness in a photo is searched as a whole (piecewise planar stereo, Sinha, Steedly &
//! Szeliski 2009): where it shows a plane, a good part of its pixels lies near the plane, and all photos have to show the same one.
//! What bounds a room has next to nothing behind it, which tells a wall from a smooth thing that stands before it.

use glam::Vec3;
use motes_math::median::upper_median;
use motes_math::rng::keyed_rng;
use rand::RngExt;
use rayon::prelude::*;

use super::flatness::{Witnesses, fitted};
use super::planes::{Plane, Sample, least_squares, reach};
use super::regions::regions;
use super::silhouettes::blurred;
use super::splat_depth::DepthMap;
use super::view::{Shown, View};

/// Share of a photo that a region has at least.
const LEAST_REGION: f32 = 0.004;
/// Texture from which a pixel belongs to no region, 0 to 1.
const BARE: f32 = 0.5;
/// Distance from a wall at which the depth of its pixels lies on it, voxels or their footprints.
pub(super) const NEAR: f32 = 5.0;
/// Pixels of a region that planes are fitted to and judged by, at most.
const SAMPLES: usize = 200;
/// Those of a piece of it that other photos are asked about.
const LOOKED_AT: usize = 100;
/// Planes that are tried per region, and regions whose plane is tried on all photos.
const TRIES: u64 = 48;
const MOST_REGIONS: usize = 300;
/// Share of a region's samples that must lie on its plane: a corner without contrast is one region of two walls.
const HELD: f32 = 0.35;
/// Least squares fits to what lies on a plane, one after the other.
const FITS: usize = 4;
/// Photos that must show a wall, walls at most, planes that are moved to where the photos agree at most, and share of the scene that may
/// lie behind a wall.
const LEAST_PHOTOS: usize = 3;
const MOST_WALLS: usize = 6;
const MOST_FITTED: usize = 24;
pub(super) const BEHIND: f32 = 0.05;
/// Difference between two photos' heights over a wall, over that of one from it (medians): noise has 1.4, a shape 0.
const TORN: f32 = 0.75;
/// The same, over a plane that is known, from which a wall along that plane is a part of it whose depth is wrong.
const BENT: f32 = 0.5;
/// Cosine of the angle up to which a plane lies along another (15 degrees).
const ALONG: f32 = 0.966;
/// Sine and cosine of the angle by which a wall that depth tells may be turned out of the right angles to those that photos tell
/// (10 degrees).
const SQUARE: (f32, f32) = (0.174, 0.985);
/// Pixels are put onto a wall where this share of those around them lies on it,
const AGREED: f32 = 0.4;
/// within this share of the photo's longer side, unless they lie so many times `NEAR` before it.
const AROUND: f32 = 0.06;
const FAR: f32 = 4.0;
const PURPOSE: u64 = 0x3a11;

/// A plane that bounds the scene, and the regions that show it.
pub(super) struct Wall {
    pub(super) plane: Plane,
    regions: Vec<usize>,
}

/// What a wall must bound, and be no part of.
pub(super) struct Surroundings<'a> {
    /// What the photos see, sampled.
    pub(super) scene: Vec<Sample>,
    /// Planes that the photos know for uneven.
    pub(super) uneven: &'a [Plane],
    /// Planes that were found, which a wall must not be a bent part of.
    pub(super) known: &'a [Plane],
    /// Those of them that photos tell: what depth tells beside them is square to them.
    pub(super) told: &'a [Plane],
    pub(super) voxel: f32,
}

/// One region of a photo, with samples of its depth.
#[derive(Clone)]
pub(super) struct Region {
    view: usize,
    pixels: Vec<u32>,
    samples: Vec<Place>,
}

/// What a pixel sees, and how far from a plane it lies on it.
#[derive(Clone, Copy)]
struct Place {
    at: Vec3,
    reach: f32,
}

impl Place {
    fn new(view: &View, map: &DepthMap, i: usize, voxel: f32) -> Self {
        let z = map.depth[i];
        let at = view.place([i % view.width, i / view.width], z);
        Self { at, reach: reach(NEAR * voxel, z * view.footprint(), voxel) }
    }

    fn lies_on(&self, plane: &Plane) -> bool {
        plane.height(self.at).abs() <= self.reach
    }
}

impl Region {
    fn new(k: usize, pixels: Vec<u32>, view: &View, map: &DepthMap, voxel: f32) -> Self {
        let stride = pixels.len().div_ceil(SAMPLES).max(1);
        let place = |&i: &u32| Place::new(view, map, i as usize, voxel);
        let samples = pixels.iter().skip(stride / 2).step_by(stride).map(place).collect();
        Self { view: k, pixels, samples }
    }

    /// Pixels that photos are asked about.
    fn looked_at(&self) -> impl Iterator<Item = u32> + '_ {
        let stride = self.pixels.len().div_ceil(LOOKED_AT).max(1);
        self.pixels.iter().skip(stride / 2).step_by(stride).copied()
    }

    fn held<'a>(&'a self, plane: &'a Plane) -> impl Iterator<Item = Vec3> + 'a {
        self.samples.iter().filter(|s| s.lies_on(plane)).map(|s| s.at)
    }

    /// Whether a good part of the region lies on the front of a plane.
    fn shows(&self, plane: &Plane, views: &[View]) -> bool {
        plane.height(views[self.view].center) > 0.0
            && self.held(plane).count() as f32 >= HELD * self.samples.len() as f32
    }

    /// The plane that holds most samples (RANSAC), its front toward the camera; `None` when it holds too few.
    fn plane(&self, view: &View, key: u64) -> Option<Plane> {
        let s = &self.samples;
        let mut best: Option<(usize, Plane)> = None;
        for i in 0..TRIES {
            let mut rng = keyed_rng(PURPOSE, key, i);
            let [a, b, c] =
                [0; 3].map(|_| s[(rng.random::<f32>() * s.len() as f32) as usize % s.len()].at);
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            let normal = if normal.dot(view.center - a) < 0.0 { -normal } else { normal };
            let plane = Plane { normal, offset: normal.dot(a) };
            let count = self.held(&plane).count();
            if best.is_none_or(|(most, _)| count > most) {
                best = Some((count, plane));
            }
        }
        let (_, mut plane) = best?;
        for _ in 0..FITS {
            plane = least_squares(&self.held(&plane).collect::<Vec<_>>(), plane)?;
        }
        (self.held(&plane).count() as f32 >= HELD * s.len() as f32).then_some(plane)
    }
}

/// The regions without texture of all photos. A wall beside a lamp goes on where it is clipped in some channels.
pub(super) fn bare_regions(
    views: &[View],
    maps: &[DepthMap],
    textures: &[Vec<f32>],
    voxel: f32,
) -> Vec<Region> {
    let of = |k: usize| {
        let (view, map) = (&views[k], &maps[k]);
        let counts: Vec<bool> = (0..map.depth.len())
            .map(|i| {
                let is_shown = matches!(view.shown[i], Shown::Whole | Shown::Clipped);
                textures[k][i] < BARE && is_shown && map.depth[i] > 0.0
            })
            .collect();
        let least = (LEAST_REGION * counts.len() as f32) as usize;
        let region = |pixels| Region::new(k, pixels, view, map, voxel);
        regions(view, &counts, least).into_iter().map(region).collect::<Vec<_>>()
    };
    let all: Vec<Vec<Region>> = (0..views.len()).into_par_iter().with_max_len(1).map(of).collect();
    all.into_iter().flatten().collect()
}

/// The walls that regions of several photos show with at least `share` of all pixels, largest first.
pub(super) fn walls(
    regions: &[Region],
    views: &[View],
    around: &Surroundings<'_>,
    witnesses: &Witnesses<'_>,
    share: f32,
) -> Vec<Wall> {
    let pixels: usize = views.iter().map(|v| v.width * v.height).sum();
    let mut largest: Vec<usize> = (0..regions.len()).collect();
    largest.sort_by_key(|&i| (std::cmp::Reverse(regions[i].pixels.len()), i));
    largest.truncate(MOST_REGIONS);
    let candidate = |i: usize| {
        let region: &Region = &regions[i];
        let plane = region.plane(&views[region.view], i as u64)?;
        around.may_have(&plane).then_some((i, plane))
    };
    let mut tried: Vec<(usize, Plane)> = largest.into_par_iter().filter_map(candidate).collect();
    let mut free = vec![true; regions.len()];
    let mut walls = Vec::new();
    let shown = |plane: &Plane, free: &[bool]| -> Vec<usize> {
        (0..regions.len()).filter(|&i| free[i] && regions[i].shows(plane, views)).collect()
    };
    let size = |shown: &[usize]| shown.iter().map(|&i| regions[i].pixels.len()).sum::<usize>();
    for _ in 0..MOST_FITTED {
        let sizes: Vec<usize> = tried.par_iter().map(|(_, p)| size(&shown(p, &free))).collect();
        let ranked = (0..tried.len()).max_by_key(|&k| (sizes[k], std::cmp::Reverse(k)));
        let is_large = |&k: &usize| sizes[k] as f32 >= share * pixels as f32;
        let Some(best) = ranked.filter(is_large).filter(|_| walls.len() < MOST_WALLS) else {
            break;
        };
        let mut plane = tried.remove(best).1;
        for _ in 0..FITS {
            let places = shown(&plane, &free).into_iter().flat_map(|i| regions[i].held(&plane));
            plane = least_squares(&places.collect::<Vec<_>>(), plane).unwrap_or(plane);
        }
        plane = fitted(plane, witnesses);
        let mut shown = shown(&plane, &free);
        shown.retain(|&i| is_flat(&regions[i], &plane, views, witnesses));
        let mut photos: Vec<usize> = shown.iter().map(|&i| regions[i].view).collect();
        photos.dedup();
        let large = size(&shown) as f32 >= share * pixels as f32;
        let is_wall = large && photos.len() >= LEAST_PHOTOS && around.may_have(&plane);
        let is_bent = |known: &Plane| {
            known.normal.dot(plane.normal) >= ALONG
                && torn(known, &shown, regions, witnesses) >= BENT
        };
        let is_bent = is_wall && around.known.iter().any(is_bent);
        if is_wall && !is_bent && torn(&plane, &shown, regions, witnesses) >= TORN {
            shown.iter().for_each(|&i| free[i] = false);
            tried.retain(|(i, _)| free[*i]);
            walls.push(Wall { plane, regions: shown });
        }
    }
    walls
}

/// How much photos disagree about the depth of a wall, over how much they deviate from it: what they agree about is shape, the rest is
/// noise.
fn torn(plane: &Plane, shown: &[usize], regions: &[Region], witnesses: &Witnesses<'_>) -> f32 {
    let (mut heights, mut between) = (Vec::new(), Vec::new());
    for region in shown.iter().map(|&i| &regions[i]) {
        for s in &region.samples {
            let height = plane.height(s.at);
            for other in witnesses.seconds(region.view, s.at) {
                between.push((plane.height(other) - height).abs() / s.reach);
                heights.push(height.abs() / s.reach);
            }
        }
    }
    let median = |mut v: Vec<f32>| upper_median(&mut v, f32::total_cmp).unwrap_or(0.0);
    median(between) / median(heights).max(f32::MIN_POSITIVE)
}

impl Surroundings<'_> {
    /// Whether a plane that depth tells may bound the scene. One along uneven ground would be a flatter part of it, and one askew to
    /// walls that photos tell is a smear of Gaussians at the rim of the capture.
    fn may_have(&self, plane: &Plane) -> bool {
        let cosine = |other: &Plane| other.normal.dot(plane.normal);
        let is_square = |t: &Plane| !(SQUARE.0..SQUARE.1).contains(&cosine(t).abs());
        self.lies_before(plane, BEHIND)
            && self.uneven.iter().all(|u| cosine(u) < ALONG)
            && self.told.iter().all(is_square)
    }

    /// Whether no more than a share of the scene lies behind a plane.
    fn lies_before(&self, plane: &Plane, share: f32) -> bool {
        plane.bounds(&self.scene, share, NEAR * self.voxel, self.voxel)
    }
}

/// Whether the photos carry the part of a region that lies on a plane no better by its depth.
fn is_flat(region: &Region, plane: &Plane, views: &[View], witnesses: &Witnesses<'_>) -> bool {
    let view = &views[region.view];
    let mut inside = vec![false; view.width * view.height];
    region.pixels.iter().for_each(|&i| inside[i as usize] = true);
    witnesses.is_flat(plane, region.view, |i| inside[i])
}

/// Puts pixels of the regions onto their walls where most around them lie there.
pub(super) fn flatten(
    walls: &[Wall],
    regions: &[Region],
    views: &[View],
    maps: &mut [DepthMap],
    voxel: f32,
) {
    for (wall, region) in
        walls.iter().flat_map(|w| w.regions.iter().map(move |&i| (w, &regions[i])))
    {
        let (view, map) = (&views[region.view], &mut maps[region.view]);
        let place = |i: usize| Place::new(view, map, i, voxel);
        let mut held = vec![f32::NAN; map.depth.len()];
        for i in region.pixels.iter().map(|&i| i as usize) {
            held[i] = f32::from(place(i).lies_on(&wall.plane));
        }
        let side = (AROUND * view.longer_side() as f32) as usize | 1;
        let agreed = blurred(&held, view.width, view.height, side);
        let flat = |&i: &u32| {
            let i = i as usize;
            let ray = view.pixel_ray([i % view.width, i / view.width]);
            let z = wall.plane.depth(view, ray)?;
            let place = place(i);
            let is_near = wall.plane.height(place.at) < FAR * place.reach;
            (agreed[i] >= AGREED && is_near).then_some((i, z))
        };
        let put: Vec<(usize, f32)> = region.pixels.iter().filter_map(flat).collect();
        put.into_iter().for_each(|(i, z)| map.depth[i] = z);
    }
}

mod consistency;
mod fit;
mod height_field;
mod joined;
mod pieces;
mod put;
mod spread;
mod sweep;
mod told;
mod vote;

pub(super) use joined::joined;
pub(super) use spread::{spread, spread_to_rest};
pub(super) use told::told;

#[cfg(test)]
mod tests;
