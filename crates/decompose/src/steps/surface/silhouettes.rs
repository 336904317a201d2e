//! Which pixels see things, and how far their depth is to be believed.
//!
//! The Gaussians show what a mirror shows by putting it behind the mirror's surface, so depth there is a pit. Such depth gives
//! itself away: the photos differ about the brightness of the place. What does not lie is where a thing ends before a
//! plane, so the pit is closed up to what the silhouettes leave over (the visual hull, Laurentini 1994), weakly.

use motes_math::median::upper_median;
use rayon::prelude::*;

use super::sheet::Sheet;
use super::splat_depth::DepthMap;
use super::view::View;

/// Pixels whose place something nearer than this many voxels hides do not see it.
const HIDDEN: f32 = 6.0;
/// Depths of other views that are nearer than this to a place agree about it, voxels.
const AGREED: f32 = 2.5;
/// Views that agree about a place from which its depth is believed in full, against the median of the capture.
const ENOUGH: f32 = 0.7;
/// Belief from which a depth shows a thing rather than something far behind.
const BELIEVED: f32 = 0.5;
/// Photos that a place is compared in, at least.
const LEAST_WITNESSES: usize = 4;
/// Side of the square that differences are averaged over, pixels, odd.
const BLUR: usize = 9;

/// What one view knows beyond its depth.
pub(super) struct Silhouette {
    /// `[h, w]`, 0 to 1: how far the depth of a pixel is believed.
    pub(super) steady: Vec<f32>,
    /// `[h, w]`: distance to the nearest pixel that sees a plane, pixels; 0 for those themselves, infinite where no plane is behind a
    /// pixel: nothing tells a thing from what is far behind it there. Empty without a plane.
    pub(super) depth_inside: Vec<f32>,
}

impl Silhouette {
    /// Whether there are planes that things stand out against.
    pub(super) fn has_outline(&self) -> bool {
        !self.depth_inside.is_empty()
    }
}

/// Belief in the depths, and silhouettes before the planes. Without planes the photos' brightness does not count: nothing would close
/// the pits of mirrors.
pub(super) fn silhouettes(
    views: &[View],
    maps: &[DepthMap],
    (sheets, flat): (&[Sheet], &[Vec<bool>]),
    voxel: f32,
    mirror_spread: f32,
) -> Vec<Silhouette> {
    if !(mirror_spread > 0.0) {
        return Vec::new();
    }
    let has_planes = flat.iter().flatten().any(|&f| f);
    let maps_of: Vec<Known> = (0..views.len())
        .into_par_iter()
        .with_max_len(1)
        .map(|i| spread_map(i, views, maps, &flat[i], voxel))
        .collect();
    let spreads: Vec<f32> =
        maps_of.iter().flat_map(|m| &m.0).copied().filter(|s| s.is_finite()).step_by(5).collect();
    if spreads.is_empty() {
        return Vec::new();
    }
    let limit = mirror_limit(mirror_spread, spreads);
    let mut all: Vec<f32> =
        maps_of.iter().flat_map(|m| &m.1).copied().filter(|a| *a > 0.0).step_by(5).collect();
    let enough = ENOUGH * median(&mut all).max(1.0);
    let of = |(((spread, agreed), flat), view): ((&Known, &Vec<bool>), &View)| {
        let spread = blurred(spread, view.width, view.height, BLUR);
        let agreed = blurred(agreed, view.width, view.height, BLUR);
        let believed = |k: usize| {
            if flat[k] {
                return 1.0;
            }
            let s = if spread[k].is_finite() { spread[k] } else { 0.0 };
            let a = if agreed[k].is_finite() { agreed[k] } else { 0.0 };
            let by_brightness = if has_planes { steady(s, limit) } else { 1.0 };
            by_brightness * (a / enough).min(1.0).powi(3)
        };
        let steady: Vec<f32> = (0..flat.len()).map(believed).collect();
        let depth_inside =
            if has_planes { inside(sheets, view, flat, &steady) } else { Vec::new() };
        Silhouette { steady, depth_inside }
    };
    maps_of.par_iter().zip(flat).zip(views).with_max_len(1).map(of).collect()
}

/// The spread of brightness from which a place counts as a mirror: the one asked for, or twice the usual one, as photos of
/// unlike exposure differ everywhere.
pub(super) fn mirror_limit(asked: f32, mut spreads: Vec<f32>) -> f32 {
    asked.max(2.0 * median(&mut spreads))
}

/// How far to believe what photos show of a place with a spread of brightness, 1 to 0; a quarter at the limit.
pub(super) fn steady(spread: f32, limit: f32) -> f32 {
    (1.0 + (spread / limit).powi(2)).powi(-2)
}

/// Two pictures of one view, `[h, w]`.
type Known = (Vec<f32>, Vec<f32>);

/// Median distance of the photos' brightness from their median at the place that a pixel sees, NaN on planes and
/// where too few photos see it; and the number of other views whose depth is there too, NaN on planes.
fn spread_map(i: usize, views: &[View], maps: &[DepthMap], flat: &[bool], voxel: f32) -> Known {
    let (view, map) = (&views[i], &maps[i]);
    let mut values: Vec<f32> = Vec::with_capacity(views.len());
    (0..map.depth.len())
        .map(|k| {
            let z = map.depth[k];
            if flat[k] || !(z > 0.0) {
                return (f32::NAN, f32::NAN);
            }
            let mut agreed = -1.0f32;
            let place = view.place([k % view.width, k / view.width], z);
            values.clear();
            for (other, map) in views.iter().zip(maps) {
                let Some(q) = other.project(place) else { continue };
                let Some(k) = other.pixel(q.x, q.y) else { continue };
                let z = map.depth[k];
                agreed += f32::from(u8::from((z - q.z).abs() < AGREED * voxel));
                if z > q.z - HIDDEN * voxel && other.weight(k) > 0.5 {
                    values.push(other.luma[k]);
                }
            }
            if values.len() < LEAST_WITNESSES.min(views.len()) {
                return (f32::NAN, agreed);
            }
            (median_distance(&mut values), agreed)
        })
        .unzip()
}

fn median(values: &mut [f32]) -> f32 {
    upper_median(values, f32::total_cmp).unwrap_or(0.0)
}

/// Median distance from the median.
pub(super) fn median_distance(values: &mut [f32]) -> f32 {
    let middle = median(values);
    values.iter_mut().for_each(|v| *v = (*v - middle).abs());
    median(values)
}

/// Mean over a square of what is finite, `side` pixels wide (odd); NaN where nothing is.
pub(super) fn blurred(values: &[f32], width: usize, height: usize, side: usize) -> Vec<f32> {
    let half = side / 2;
    let along = |sums: &[(f32, f32)], step: usize, count: usize, at: usize, first: usize| {
        let (low, high) = (at.saturating_sub(half), (at + half).min(count - 1));
        (low..=high).fold((0.0, 0.0), |(s, n), k| {
            let (a, b) = sums[first + k * step];
            (s + a, n + b)
        })
    };
    let start: Vec<(f32, f32)> =
        values.iter().map(|v| if v.is_finite() { (*v, 1.0) } else { (0.0, 0.0) }).collect();
    let rows: Vec<(f32, f32)> =
        (0..values.len()).map(|k| along(&start, 1, width, k % width, k / width * width)).collect();
    (0..values.len())
        .map(|k| {
            let (sum, count) = along(&rows, width, height, k / width, k % width);
            if count > 0.0 { sum / count } else { f32::NAN }
        })
        .collect()
}

/// How far pixels lie inside what stands out against the sheets; infinite where none is behind them and their depth is not believed
/// either.
fn inside(sheets: &[Sheet], view: &View, flat: &[bool], steady: &[f32]) -> Vec<f32> {
    let (width, mut depth) = (view.width, distance_to(flat, view.width, view.height));
    for (k, depth) in depth.iter_mut().enumerate() {
        if flat[k] || steady[k] >= BELIEVED {
            continue;
        }
        let ray = view.pixel_ray([k % width, k / width]);
        if !sheets.iter().any(|sheet| sheet.met(view, ray).is_some()) {
            *depth = f32::INFINITY;
        }
    }
    depth
}

/// Distance to the nearest marked pixel, by two passes of the 3-4 chamfer (Borgefors 1986); large without one.
fn distance_to(marked: &[bool], width: usize, height: usize) -> Vec<f32> {
    let far = 3.0 * (width + height) as f32;
    let mut d: Vec<f32> = marked.iter().map(|&m| if m { 0.0 } else { far }).collect();
    let mut relax = |i: usize, j: usize, steps: [(isize, isize, f32); 4]| {
        let mut best = d[j * width + i];
        for (dx, dy, cost) in steps {
            let (x, y) = (i as isize + dx, j as isize + dy);
            if x >= 0 && y >= 0 && x < width as isize && y < height as isize {
                best = best.min(d[y as usize * width + x as usize] + cost);
            }
        }
        d[j * width + i] = best;
    };
    let diagonal = 4.0 / 3.0;
    for j in 0..height {
        for i in 0..width {
            relax(i, j, [(-1, 0, 1.0), (0, -1, 1.0), (-1, -1, diagonal), (1, -1, diagonal)]);
        }
    }
    for j in (0..height).rev() {
        for i in (0..width).rev() {
            relax(i, j, [(1, 0, 1.0), (0, 1, 1.0), (1, 1, diagonal), (-1, 1, diagonal)]);
        }
    }
    d
}
