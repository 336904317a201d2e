//! Neighbors of a row of pixels at once.
//!
//! Plain loops over lanes, which the compiler turns into the vectors of the instruction set that the caller dispatches to. Every lane
//! does what one pixel alone would, in the same order, so that all instruction sets give the same bits.

use glam::Vec3;

use super::PixelAovs;
use super::shape::WorldShape;
use crate::binning::TileRow;
use crate::exp2::exp2_minus_8_lanes;
use crate::options::ALPHA_MAX;
use crate::parameters::RasterParameters;
use crate::splat::Splat;
use crate::view::ViewTransform;

/// Pixels at once.
pub(super) const LANES: usize = 8;
/// One value per pixel.
pub(super) type Lanes<T> = [T; LANES];
/// The list of a tile.
pub(super) type List<'a> = Option<(&'a TileRow, &'a [u32])>;

/// What the pixels of a view see.
pub(super) struct Seen<'a> {
    pub(super) shapes: &'a [WorldShape],
    pub(super) view: &'a ViewTransform,
    pub(super) parameters: &'a RasterParameters,
}

impl Seen<'_> {
    /// All that is told of pixels from the one whose center is `at`, to the right.
    #[inline(always)]
    pub(super) fn composite(&self, list: List<'_>, at: [f32; 2]) -> Lanes<PixelAovs> {
        let rays = self.rays(at);
        let least = self.parameters.transmittance_min;
        let mut transmittance = [1.0f32; LANES];
        let (mut depth, mut weights, mut median) = ([0.0f32; LANES], [0.0; LANES], [0.0; LANES]);
        let mut normal = [[0.0f32; LANES]; 3];
        for (splat, shape) in splats(list, self.shapes) {
            let Some(alpha) = self.alpha(splat, at, &transmittance, least) else { continue };
            let depths = depths(shape, &rays, splat.depth);
            for k in 0..LANES {
                let weight = alpha[k] * transmittance[k];
                // What is not finite has no part where it is not seen.
                let part = |value: f32| if alpha[k] > 0.0 { weight * value } else { 0.0 };
                depth[k] += part(depths[k]);
                normal[0][k] += part(shape.normal.x);
                normal[1][k] += part(shape.normal.y);
                normal[2][k] += part(shape.normal.z);
                weights[k] += weight;
                let next = transmittance[k] - weight;
                let is_median = transmittance[k] > 0.5 && next <= 0.5;
                median[k] = if is_median { depths[k] } else { median[k] };
                transmittance[k] = next;
            }
            if transmittance.iter().all(|t| *t < least) {
                break;
            }
        }
        std::array::from_fn(|k| PixelAovs {
            depth_expected: if weights[k] > 0.0 { depth[k] / weights[k] } else { 0.0 },
            depth_median: median[k],
            normal: Vec3::new(normal[0][k], normal[1][k], normal[2][k]).normalize_or_zero(),
        })
    }

    /// The median depth alone; 0 where more than `enough` passes all.
    #[inline(always)]
    pub(super) fn depth_median(&self, list: List<'_>, at: [f32; 2], enough: f32) -> Lanes<f32> {
        let rays = self.rays(at);
        let (mut transmittance, mut median) = ([1.0f32; LANES], [0.0f32; LANES]);
        let least = enough.next_up();
        for (splat, shape) in splats(list, self.shapes) {
            let Some(alpha) = self.alpha(splat, at, &transmittance, least) else { continue };
            let mut next = transmittance;
            for k in 0..LANES {
                next[k] -= alpha[k] * transmittance[k];
            }
            if (0..LANES).any(|k| transmittance[k] > 0.5 && next[k] <= 0.5) {
                let depths = depths(shape, &rays, splat.depth);
                for k in 0..LANES {
                    let is_median = transmittance[k] > 0.5 && next[k] <= 0.5;
                    median[k] = if is_median { depths[k] } else { median[k] };
                }
            }
            transmittance = next;
            if transmittance.iter().all(|t| *t <= enough) {
                break;
            }
        }
        std::array::from_fn(|k| if transmittance[k] <= enough { median[k] } else { 0.0 })
    }

    /// Directions of the pixels in the camera frame whose depth is 1: the column of each, and the row of all.
    #[inline(always)]
    fn rays(&self, [x, y]: [f32; 2]) -> (Lanes<f32>, f32) {
        let slope = |at: f32, k: usize| (at - self.view.principal[k]) / self.view.focal[k];
        (std::array::from_fn(|k| slope(x + k as f32, 0)), slope(y, 1))
    }

    /// [`Splat::alpha_at`] of the pixels; 0 below the cut-offs and where less than `least` is left. None where all are 0.
    #[inline(always)]
    fn alpha(
        &self,
        splat: &Splat,
        [x, y]: [f32; 2],
        transmittance: &Lanes<f32>,
        least: f32,
    ) -> Option<Lanes<f32>> {
        let dy = y - splat.y;
        let (slant, d) = (splat.sb * dy, splat.sd * dy);
        let of_row = d * d - splat.level;
        // What a column adds is a square.
        if !(of_row <= -splat.threshold) {
            return None;
        }
        let mut level = [0.0f32; LANES];
        let mut is_seen = [false; LANES];
        for k in 0..LANES {
            let e = splat.sa * (x + k as f32 - splat.x) + slant;
            level[k] = e * e + of_row;
            is_seen[k] = level[k] <= -splat.threshold && transmittance[k] >= least;
        }
        if !is_seen.contains(&true) {
            return None;
        }
        let alpha = exp2_minus_8_lanes(self.parameters.exp_degree.into(), &level);
        Some(std::array::from_fn(|k| if is_seen[k] { alpha[k].min(ALPHA_MAX) } else { 0.0 }))
    }
}

/// [`WorldShape::depth`] of the pixels.
#[inline(always)]
fn depths(shape: &WorldShape, (x, y): &(Lanes<f32>, f32), center: f32) -> Lanes<f32> {
    std::array::from_fn(|k| shape.depth(Vec3::new(x[k], *y, 1.0), center))
}

/// The splats of a tile's list with their shapes, front to back.
#[inline(always)]
pub(super) fn splats<'a>(
    list: List<'a>,
    shapes: &'a [WorldShape],
) -> impl Iterator<Item = (&'a Splat, &'a WorldShape)> {
    list.into_iter().flat_map(move |(row, entries)| {
        entries.iter().map(move |&e| {
            let id = row.ids[e as usize] as usize;
            (&row.splats[e as usize], &shapes[id])
        })
    })
}
