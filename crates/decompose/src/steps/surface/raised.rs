//! What seems to lie on a plane, but is an error of depth.
//!
//! Where few photos look, Gaussians hang before a wall and show what it shows. Their depth is a bump of some voxels, as a thing that lies on
//! the wall would be. The photos tell them apart: a bump carries what one photo shows to the wrong places of the others, and the plane to the right ones.

use rayon::prelude::*;

use super::flatness::{STRIDE, Witnesses, inner_pixels};
use super::planes::reach;
use super::sheet::{Crossing, Sheet};
use super::splat_depth::DepthMap;
use super::view::View;

/// What rises over a sheet by so many tolerances stands on it.
const MOST_RISE: f32 = 6.0;
/// Pixels to each side that show nothing which stands there: its rim is blurred.
const RIM: usize = 2;

/// Puts pixels that end a little before a sheet onto it, where it explains the photos better than their depth. Adds them to `on_sheets`.
pub(super) fn put_down(
    sheets: &[Sheet],
    views: &[View],
    maps: &mut [DepthMap],
    on_sheets: &mut [Vec<bool>],
    tolerance: f32,
    voxel: f32,
) {
    for sheet in sheets {
        let raised =
            |view: &View, map: &DepthMap, at| raised(sheet, view, map, at, tolerance, voxel);
        let is_better = {
            let maps = &*maps;
            let of = |(view, map): (&View, &DepthMap)| {
                let mut pixels = inner_pixels(view, STRIDE);
                pixels.retain(|&at| raised(view, map, at).is_some());
                pixels
            };
            let pixels: Vec<_> = views.par_iter().zip(maps).with_max_len(1).map(of).collect();
            // Whether something hides a place does not count: what is asked is whether there is something.
            let witnesses = Witnesses::new(views, maps, tolerance, voxel);
            sheet.is_better(&witnesses.compare(&sheet.plane, &pixels, &[]))
        };
        let put = |((view, map), on): ((&View, &mut DepthMap), &mut Vec<bool>)| {
            let errs = |c: &Crossing| sheet.at(c.at).is_some_and(|k| is_better[k]);
            let of = |i| raised(view, map, [i % view.width, i / view.width]).filter(errs);
            let found: Vec<Option<Crossing>> = (0..map.depth.len()).map(of).collect();
            for ((z, on), c) in map.depth.iter_mut().zip(on).zip(found) {
                if let Some(c) = c {
                    (*z, *on) = (c.depth, true);
                }
            }
        };
        views.par_iter().zip(&mut *maps).zip(&mut *on_sheets).with_max_len(1).for_each(put);
    }
}

/// Where the ray of a pixel meets the sheet, when its depth ends a little before it and nothing that stands there is beside it.
fn raised(
    sheet: &Sheet,
    view: &View,
    map: &DepthMap,
    [x, y]: [usize; 2],
    tolerance: f32,
    voxel: f32,
) -> Option<Crossing> {
    let rise = |x: usize, y: usize| {
        let z = map.depth[y * view.width + x];
        let height = sheet.plane.height(view.place([x, y], z));
        if z > 0.0 { height / reach(tolerance, z * view.footprint(), voxel) } else { 0.0 }
    };
    if !(rise(x, y) > 1.0) {
        return None;
    }
    let crossing = sheet.met(view, view.pixel_ray([x, y]))?;
    let mut rows = y.saturating_sub(RIM)..(y + RIM + 1).min(view.height);
    let columns = x.saturating_sub(RIM)..(x + RIM + 1).min(view.width);
    rows.all(|y| columns.clone().all(|x| rise(x, y) <= MOST_RISE)).then_some(crossing)
}

#[cfg(test)]
mod tests;
