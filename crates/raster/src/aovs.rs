//! Depth and normals: passes over the tile lists of a finished frame.

mod row;
mod shape;

use fearless_simd::dispatch;
use glam::Vec3;
use motes_scene::{Gaussians, ImageF32};
use rayon::prelude::*;

use crate::frame::Frame;
use crate::parameters::RasterParameters;
use crate::render::Aovs;
use crate::view::ViewTransform;
use row::{LANES, Lanes, Seen};
use shape::WorldShape;

/// Depths and normals of the last forward pass of `frame`.
pub(crate) fn tile_aovs(
    frame: &Frame,
    gaussians: &Gaussians,
    view: &ViewTransform,
    parameters: &RasterParameters,
) -> Aovs {
    let [width, height] = view.size;
    let shapes = shapes(frame, gaussians, view);
    let pixels = per_pixel(
        frame,
        &shapes,
        view,
        parameters,
        |seen, list, at| dispatch!(parameters.level(), _simd => seen.composite(list, at)),
    );
    let plane = |f: &dyn Fn(&PixelAovs) -> f32| {
        ImageF32::from_data(width, height, 1, pixels.iter().map(f).collect())
    };
    let normal = pixels.iter().flat_map(|p| p.normal.to_array()).collect();
    Aovs {
        depth_expected: plane(&|p| p.depth_expected),
        depth_median: plane(&|p| p.depth_median),
        normal_in_world: ImageF32::from_data(width, height, 3, normal),
    }
}

/// `[h, w, 1]`, `depth_median` of [`Aovs`] where the coverage is at least `least_alpha`, and 0 elsewhere. What lies behind the
/// pixel's answer is not looked at: half the time of all AOVs.
pub(crate) fn tile_depth_median(
    frame: &Frame,
    gaussians: &Gaussians,
    view: &ViewTransform,
    parameters: &RasterParameters,
    least_alpha: f32,
) -> ImageF32 {
    let [width, height] = view.size;
    let enough = (1.0 - least_alpha).min(0.5);
    let shapes = shapes(frame, gaussians, view);
    let depth = per_pixel(
        frame,
        &shapes,
        view,
        parameters,
        |seen, list, at| dispatch!(parameters.level(), _simd => seen.depth_median(list, at, enough)),
    );
    ImageF32::from_data(width, height, 1, depth)
}

fn shapes(frame: &Frame, gaussians: &Gaussians, view: &ViewTransform) -> Vec<WorldShape> {
    (0..gaussians.len())
        .into_par_iter()
        .map(|i| match frame.projected()[i].is_visible() {
            true => WorldShape::new(gaussians, i, view),
            false => WorldShape::default(),
        })
        .collect()
}

/// What `of` makes of each pixel, of [`LANES`] neighbors at a time: of their list, and the center of the first.
fn per_pixel<T: Send + Copy>(
    frame: &Frame,
    shapes: &[WorldShape],
    view: &ViewTransform,
    parameters: &RasterParameters,
    of: impl Fn(&Seen<'_>, row::List<'_>, [f32; 2]) -> Lanes<T> + Sync,
) -> Vec<T> {
    let [width, height] = view.size;
    let seen = Seen { shapes, view, parameters };
    let row = |y: usize| {
        let mut out = Vec::with_capacity(width);
        for x in (0..width).step_by(LANES) {
            // A tile is 8, 16 or 32 pixels wide.
            let list = frame.bins().list_at(x, y);
            let found = of(&seen, list, [x as f32 + 0.5, y as f32 + 0.5]);
            out.extend_from_slice(&found[..LANES.min(width - x)]);
        }
        out
    };
    let rows: Vec<Vec<T>> = (0..height).into_par_iter().map(row).collect();
    rows.into_iter().flatten().collect()
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct PixelAovs {
    depth_expected: f32,
    depth_median: f32,
    normal: Vec3,
}

#[cfg(test)]
mod tests;
