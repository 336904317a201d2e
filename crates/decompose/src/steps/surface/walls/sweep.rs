//! The plane that a region tells by what other photos show (plane sweep, Collins 1996, over all three parameters of a plane).

use glam::{Mat3, Vec2, Vec3};
use motes_math::median::upper_median;
use motes_math::rng::keyed_rng;
use rand::RngExt;

use super::Region;
use super::consistency::Photos;
use crate::steps::surface::planes::Plane;

/// Planes that are tried at random, those of them that are improved, and steps of that.
const STARTS: u64 = 64;
const IMPROVED: usize = 2;
const STEPS: u64 = 70;
/// Widths of the ranges they come from: the logarithm of the inverse depth around that of the region, and the share that it
/// changes by over the region's deviation to the right and down.
const DEPTHS: f32 = 1.2;
const SLOPES: f32 = 1.0;
/// First and last scale of the steps, and what it is multiplied by after a step that was none.
const FIRST: f32 = 0.2;
const LAST: f32 = 0.002;
const SHRINK: f32 = 0.96;
/// Share of the comparisons of its depth that a plane must leave.
const COMPARED: f32 = 0.5;
/// A plane is told where it leaves at most this share of the difference that depth leaves,
pub(super) const BETTER: f32 = 0.9;
/// and leaves so many times as much after it is moved by this share of the distance either way.
pub(super) const SHARP: f32 = 1.1;
pub(super) const MOVED: [f32; 2] = [-0.1, 0.1];
const PURPOSE: u64 = 0x5eeb;

/// The plane of a region; `None` where other photos do not tell it, or tell it no better than its depth.
pub(super) fn sweep(photos: &Photos<'_>, region: &Region) -> Option<Plane> {
    let slopes = Slopes::new(photos, region)?;
    let by_depth = photos.by_depth(region)?;
    let least = COMPARED * by_depth.count as f32;
    let cost = |w: Vec3| {
        let cost = photos.by_plane(region, &slopes.plane(w));
        cost.filter(|c| c.count as f32 >= least).map_or(f32::INFINITY, |c| c.mean)
    };
    let key = (region.view as u64) << 32 | u64::from(region.pixels[0]);
    let start = |i: u64| {
        let mut rng = keyed_rng(PURPOSE, key, i);
        let [a, b, c] = [0; 3].map(|_| rng.random::<f32>() - 0.5);
        let w = Vec3::new(1.0, 1.0 + SLOPES * b, 1.0 + SLOPES * c);
        let w = slopes.inverse_depth * (DEPTHS * a).exp() * w;
        (cost(w), w)
    };
    let mut starts: Vec<(f32, Vec3)> = (0..STARTS).map(start).filter(|s| s.0.is_finite()).collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    // All three together, and each of them by half as much.
    let step = |w: Vec3, scale: f32, [a, b, c, d]: [f32; 4]| {
        w * (1.0 + scale * a) + w * Vec3::new(b, c, d) * scale * 0.5
    };
    let improved = starts.iter().take(IMPROVED);
    let improved = improved.map(|&(_, w)| descend(w, [key, 0], STEPS, FIRST, cost, step));
    let (least, w) = improved.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let plane = slopes.plane(w);
    let is_sharp = |&share: &f32| {
        let moved = photos.by_moved(region, &plane, share);
        moved.is_none_or(|c| c.mean >= SHARP * least)
    };
    (least < BETTER * by_depth.mean && MOVED.iter().all(is_sharp)).then_some(plane)
}

/// Descends at random to less `cost`, in ever smaller steps: `step` makes a neighbor from a scale and four random numbers from -1
/// to 1. Returns the least cost and where it is.
pub(super) fn descend<T: Copy>(
    start: T,
    [key, round]: [u64; 2],
    steps: u64,
    first: f32,
    cost: impl Fn(T) -> f32,
    step: impl Fn(T, f32, [f32; 4]) -> T,
) -> (f32, T) {
    let (mut best, mut least, mut scale) = (start, cost(start), first);
    for i in 0..steps {
        let mut rng = keyed_rng(PURPOSE + 1 + round, key, i);
        let random = [0; 4].map(|_| rng.random::<f32>() + rng.random::<f32>() - 1.0);
        let tried = step(best, scale, random);
        let found = cost(tried);
        if found < least {
            (best, least) = (tried, found);
        } else {
            scale = (SHRINK * scale).max(LAST);
        }
    }
    (least, best)
}

/// Planes before a camera, by the inverse depths of three rays through a region, which they are linear in.
struct Slopes {
    from_inverse_depths: Mat3,
    center: Vec3,
    /// That of the region.
    inverse_depth: f32,
}

impl Slopes {
    fn new(photos: &Photos<'_>, region: &Region) -> Option<Self> {
        let (view, map) = (&photos.views[region.view], &photos.maps[region.view]);
        let at = |k: u32| Vec2::from(view.at(k).map(|v| v as f32 + 0.5));
        let count = region.looked_at().count() as f32;
        let middle = region.looked_at().map(at).sum::<Vec2>() / count;
        let squares = region.looked_at().map(|k| at(k).distance_squared(middle)).sum::<f32>();
        let deviation = (squares / count).sqrt();
        let places = [middle, middle + Vec2::X * deviation, middle + Vec2::Y * deviation];
        let [a, b, c] = places.map(|p| view.ray(p.x, p.y));
        let mut depths: Vec<f32> = region.looked_at().map(|k| map.depth[k as usize]).collect();
        let inverse_depth = 1.0 / upper_median(&mut depths, f32::total_cmp)?;
        let from_inverse_depths = Mat3::from_cols(a, b, c).transpose().inverse();
        (inverse_depth.is_finite() && from_inverse_depths.is_finite()).then_some(Self {
            from_inverse_depths,
            center: view.center,
            inverse_depth,
        })
    }

    fn plane(&self, inverse_depths: Vec3) -> Plane {
        // `1 / z = m · ray` on the plane.
        let m = self.from_inverse_depths * inverse_depths;
        let normal = -m.normalize_or_zero();
        Plane { normal, offset: normal.dot(self.center) - 1.0 / m.length() }
    }
}

#[cfg(test)]
mod tests;
