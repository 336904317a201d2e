//! Heights over a plane that the Gaussians of all photos show together, and whether the photos carry them.
//!
//! The Gaussians of one photo's sight are noise on any bare surface, so every plane through their middle explains the photos better.
//! What all photos show together is what the surface would be without the plane. Where ground is uneven, half of its heights
//! explain more than none of them, although the whole, with its noise, may not. On a wall they only take away.

use std::collections::BTreeMap;

use glam::Vec3;
use motes_math::median::upper_median;
use rayon::prelude::*;

use super::Region;
use super::consistency::{Photos, Place};
use crate::steps::surface::planes::Plane;

/// Side of a cell that has one height, voxels, and pixels that it has at least.
const CELL: f32 = 8.0;
const LEAST_PIXELS: usize = 20;
/// What is farther from the plane than this share of the camera's distance to it shows something else.
const MOST_HEIGHT: f32 = 0.2;
/// Share of the heights that must not explain more than the plane does.
const SHARE: f32 = 0.5;
/// Steps of a ray to where it meets the heights.
const STEPS: usize = 4;

/// Median heights over a plane, in cells along it.
struct HeightField<'a> {
    plane: &'a Plane,
    axes: [Vec3; 2],
    cell: f32,
    heights: BTreeMap<[i32; 2], f32>,
}

impl<'a> HeightField<'a> {
    fn new(photos: &Photos<'_>, regions: &[&Region], plane: &'a Plane, voxel: f32) -> Self {
        let (u, v) = plane.normal.any_orthonormal_pair();
        let mut field = Self { plane, axes: [u, v], cell: CELL * voxel, heights: BTreeMap::new() };
        let mut cells: BTreeMap<[i32; 2], Vec<f32>> = BTreeMap::new();
        for region in regions {
            let (view, map) = (&photos.views[region.view], &photos.maps[region.view]);
            let most = MOST_HEIGHT * plane.height(view.center);
            for &k in &region.pixels {
                let at = view.place(view.at(k), map.depth[k as usize]);
                let height = plane.height(at);
                if height.abs() <= most {
                    let cell = field.along(at).map(|x| x.round() as i32);
                    cells.entry(cell).or_default().push(height);
                }
            }
        }
        cells.retain(|_, heights| heights.len() >= LEAST_PIXELS);
        let median = |mut heights: Vec<f32>| upper_median(&mut heights, f32::total_cmp);
        let heights = cells.into_iter().filter_map(|(cell, all)| Some((cell, median(all)?)));
        field.heights = heights.collect();
        field
    }

    /// Where a place is along the plane, cells.
    fn along(&self, place: Vec3) -> [f32; 2] {
        self.axes.map(|axis| axis.dot(place) / self.cell)
    }

    /// The height at a place, bilinear between cells.
    fn height(&self, place: Vec3) -> Option<f32> {
        let [x, y] = self.along(place);
        let [i, j] = [x, y].map(|x| x.floor() as i32);
        // A ray along the plane meets it anywhere.
        let of = |dx, dy| self.heights.get(&[i.saturating_add(dx), j.saturating_add(dy)]).copied();
        let (a, b) = (x - x.floor(), y - y.floor());
        let row = |dy| Some((1.0 - a) * of(0, dy)? + a * of(1, dy)?);
        Some((1.0 - b) * row(0)? + b * row(1)?).filter(|height| height.is_finite())
    }

    /// What a share of the heights leaves unexplained of a region, and the plane, of the same pixels; weighted by comparisons.
    fn costs(&self, photos: &Photos<'_>, region: &Region, share: f32) -> Option<[f64; 2]> {
        let view = &photos.views[region.view];
        let met = |k: u32, share: f32| {
            let (at, mut height, mut met) = (view.at(k), 0.0, Vec3::ZERO);
            for _ in 0..STEPS {
                let level = Plane { offset: self.plane.offset + height, ..*self.plane };
                met = view.place(at, level.depth(view, view.pixel_ray(at))?);
                height = share * self.height(met)?;
            }
            Some((k, met))
        };
        let pair = |k| Some((met(k, share)?, met(k, 0.0)?));
        let (raised, level): (Vec<Place>, Vec<Place>) = region.looked_at().filter_map(pair).unzip();
        let (raised, level) =
            (photos.cost(region.view, &raised)?, photos.cost(region.view, &level)?);
        Some([raised, level].map(|c| f64::from(c.mean) * level.count as f64))
    }
}

/// Whether the heights over a plane that regions show together explain the photos no better than the plane does.
pub(super) fn is_even(photos: &Photos<'_>, regions: &[&Region], plane: &Plane, voxel: f32) -> bool {
    let field = HeightField::new(photos, regions, plane, voxel);
    let costs = |region: &&Region| field.costs(photos, region, SHARE);
    let costs: Vec<Option<[f64; 2]>> = regions.par_iter().with_max_len(1).map(costs).collect();
    let [raised, level] = costs
        .into_iter()
        .flatten()
        .fold([0.0; 2], |[a, b], [raised, level]| [a + raised, b + level]);
    raised >= level
}

#[cfg(test)]
mod tests;
