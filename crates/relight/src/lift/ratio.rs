//! The change of light in a view: `ln((relit + ε) / (rendered + ε))`, linear, smoothed.
//!
//! Smoothing is an à-trous filter by normalized convolution: pixels count by how much they can say (not
//! clipped, not dark, not masked), depth is not smoothed across, nor are steps of light itself.

use glam::Vec3;
use motes_raster::Rendering;
use rayon::prelude::*;

use super::RelitView;
use crate::denoise::falloff;
use motes_math::srgb;

/// Below this linear value a ratio says little.
const FLOOR: f32 = 0.005;
/// Encoded values from here on count as clipped.
const CLIPPED: f32 = 253.5 / 255.0;
/// What a clipped channel's pixel still counts.
const CLIPPED_WEIGHT: f32 = 0.1;
/// Step in depth, as a share of it, and step in the log ratio that smoothing stops at.
const DEPTH_STEP: f32 = 0.01;
const LIGHT_STEP: f32 = 0.5;
const SPLINE: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];

/// Log ratio and weight per pixel.
pub(super) struct Ratio {
    pub(super) log: Vec<Vec3>,
    pub(super) weight: Vec<f32>,
}

/// Of a view against what the Gaussians show there.
pub(super) fn ratio(view: &RelitView, rendered: &Rendering, radius_share: f32) -> Ratio {
    let (width, height) = (view.picture.width, view.picture.height);
    let pixel = |i: usize| {
        let relit = Vec3::from_slice(&view.picture.data[3 * i..3 * i + 3]);
        let drawn = Vec3::from_slice(&rendered.color.data[3 * i..3 * i + 3]);
        let linear = |c: Vec3| Vec3::from(c.to_array().map(|v| srgb::decode(v.clamp(0.0, 1.0))));
        let (a, b) = (linear(relit), linear(drawn));
        let log = Vec3::from(((a + FLOOR) / (b + FLOOR)).to_array().map(f32::ln));
        let bright = a.max(b).max_element();
        let mut weight = rendered.alpha.data[i].powi(2) * bright / (bright + 4.0 * FLOOR);
        if relit.max_element() >= CLIPPED || drawn.max_element() >= CLIPPED {
            weight *= CLIPPED_WEIGHT;
        }
        weight *= view.mask.as_ref().map_or(1.0, |mask| mask.data[i]);
        if log.is_finite() && weight > 0.0 { (log, weight) } else { (Vec3::ZERO, 0.0) }
    };
    let (mut log, mut weight): (Vec<Vec3>, Vec<f32>) =
        (0..width * height).into_par_iter().map(pixel).unzip();
    let depth = rendered.aovs.as_ref().map(|aovs| &aovs.depth_expected.data[..]);
    let mut step = 1;
    while step as f32 <= radius_share * width as f32 {
        let pass = |i: usize| smooth(&log, &weight, depth, [width, height], i, step);
        (log, weight) = (0..width * height).into_par_iter().map(pass).unzip();
        step *= 2;
    }
    // A pixel of no weight may have got some from its neighbors: it still says nothing.
    let said = |i: usize| if pixel(i).1 > 0.0 { weight[i] } else { 0.0 };
    let weight = (0..width * height).into_par_iter().map(said).collect();
    Ratio { log, weight }
}

fn smooth(
    log: &[Vec3],
    weight: &[f32],
    depth: Option<&[f32]>,
    [width, height]: [usize; 2],
    i: usize,
    step: i32,
) -> (Vec3, f32) {
    let (x, y) = ((i % width) as i32, (i / width) as i32);
    let (mut sum, mut weights, mut area) = (Vec3::ZERO, 0.0f32, 0.0f32);
    for dy in -2..=2i32 {
        for dx in -2..=2i32 {
            let (xx, yy) = (x + dx * step, y + dy * step);
            if xx < 0 || yy < 0 || xx >= width as i32 || yy >= height as i32 {
                continue;
            }
            let k = yy as usize * width + xx as usize;
            let mut apart = 0.0;
            if let Some(depth) = depth {
                let slope = DEPTH_STEP * depth[i].max(1e-12) * step as f32;
                apart += (depth[k] - depth[i]).abs() / slope;
            }
            // Light is compared only where the own pixel knows it.
            if weight[i] > 0.0 && weight[k] > 0.0 {
                apart += (log[k] - log[i]).abs().max_element() / LIGHT_STEP;
            }
            let h = SPLINE[dx.unsigned_abs() as usize] * SPLINE[dy.unsigned_abs() as usize];
            let h = h * falloff(apart);
            sum += log[k] * (h * weight[k]);
            weights += h * weight[k];
            area += h;
        }
    }
    if weights > 0.0 { (sum / weights, weights / area) } else { (log[i], 0.0) }
}
