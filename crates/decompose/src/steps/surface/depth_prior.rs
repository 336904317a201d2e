//! Depth where the photos have no texture.
//!
//! A wall of one color fits the photos wherever the Gaussians put it: their depth there is an accident of the fit. What is textured
//! around it has a depth, and most surfaces go on as they are. Per view, the inverse depth `u = 1 / z`, which is affine on planes,
//! minimizes
//!
//! ```text
//! E(u) = Σ w φ((u - u₀) / σ) + λ Σ g [ψ(∂xx u / σ) + 2 ψ(∂xy u / σ) + ψ(∂yy u / σ)]
//! ```
//!
//! (second-order smoothness, Woodford et al. 2009) with `u₀` that of the Gaussians, `w` the texture of the photo, `σ` the inverse
//! depth that a voxel changes, `g` small at the photo's edges, and `φ`, `ψ` of Geman & McClure, so that outliers, depth steps and
//! creases do not count. Solved from coarse to fine; the finest grid is half the size of the photo. Pixels take the solution as
//! far as they have no texture.

use motes_math::median::upper_median;
use rayon::prelude::*;

use super::silhouettes::blurred;
use super::splat_depth::DepthMap;
use super::view::View;
use crate::mesh::conjugate_gradients::solve;

mod grid;

use grid::Grid;

/// Squared noise of a photo (mean squared gradient, sRGB-encoded): its quietest tenth, between half a step of 255 and three.
const QUIET: f32 = 0.1;
const LEAST_NOISE: f32 = 0.5 / 255.0;
const MOST_NOISE: f32 = 3.0 / 255.0;
/// Side of the square that texture is averaged over, pixels: a wider one counts the wall beside an edge as textured.
const WINDOW: usize = 3;
/// Texture is what exceeds the squared noise by this factor,
const ABOVE_NOISE: f32 = 4.0;
/// and counts half at this gradient.
const HALF_TEXTURE: f32 = 4.0 / 255.0;
/// `λ`, pixels to the power of 4: depth with texture is smoothed over about two pixels.
const SMOOTHNESS: f32 = 30.0;
/// The coarsest grid has about this many pixels along its shorter side.
const COARSEST: usize = 12;
/// Deviation from the Gaussians' depth that counts a quarter, voxels, and change of slope that does, voxels per pixel: a crease
/// of 90 degrees changes it by 1.3.
const OUTLIER: f32 = 6.0;
const BEND: f32 = 0.1;
/// Iterations of a solve.
const ITERATIONS: usize = 60;
/// Scales of the robust costs, solve by solve. The first on the coarsest grid is quadratic: bumps that nothing supports would
/// otherwise pass for steps.
const CLOSING: [f32; 4] = [f32::INFINITY, 8.0, 2.0, 1.0];
const CLOSED: [f32; 2] = [1.0, 1.0];

/// Replaces the depth of pixels without texture in both `maps` and `front` by the smoothest that goes with the depth of
/// `maps` around them. `voxel` in the unit world. Shapes of `length` times the longer side of the photo are kept even without texture:
/// the Gaussians know them from outlines. Returns the share of the pixels with a depth that were replaced by more than half.
pub(super) fn smooth_untextured(
    views: &[View],
    maps: &mut [DepthMap],
    front: &mut [DepthMap],
    voxel: f32,
    length: f32,
) -> f64 {
    if !(length > 0.0) {
        return 0.0;
    }
    let of = |((view, map), front): ((&View, &mut DepthMap), &mut DepthMap)| {
        let texture = texture(view);
        let Some(smooth) = smoothed(view, map, &texture, voxel, length) else { return (0, 0) };
        let mut counts = (0, 0);
        for (k, &s) in smooth.iter().enumerate() {
            if !(s > 0.0) {
                continue;
            }
            counts.0 += usize::from(texture[k] < 0.5);
            counts.1 += 1;
            for z in [&mut map.depth[k], &mut front.depth[k]] {
                if *z > 0.0 {
                    *z = 1.0 / (texture[k] / *z + (1.0 - texture[k]) * s);
                }
            }
        }
        counts
    };
    let counts: Vec<(usize, usize)> =
        views.par_iter().zip(maps).zip(front).with_max_len(1).map(of).collect();
    let (replaced, all) = counts.into_iter().fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    replaced as f64 / all.max(1) as f64
}

/// `[h, w]`, 0 to 1: how far the photo has texture.
pub(super) fn texture(view: &View) -> Vec<f32> {
    let (w, h) = (view.width, view.height);
    let squares: Vec<f32> = (0..w * h)
        .map(|k| {
            let (x, y) = (k % w, k / w);
            let of = |low: usize, high: usize| 0.5 * (view.luma[high] - view.luma[low]);
            let dx = of(k - usize::from(x > 0), k + usize::from(x + 1 < w));
            let dy = of(k - w * usize::from(y > 0), k + w * usize::from(y + 1 < h));
            if view.weight(k) > 0.5 { dx * dx + dy * dy } else { f32::NAN }
        })
        .collect();
    let energy = blurred(&squares, w, h, WINDOW);
    let mut known: Vec<f32> = energy.iter().copied().filter(|e| e.is_finite()).collect();
    known.sort_unstable_by(f32::total_cmp);
    let quiet = known.get((QUIET * known.len() as f32) as usize).copied().unwrap_or(0.0);
    let noise = quiet.clamp(LEAST_NOISE * LEAST_NOISE, MOST_NOISE * MOST_NOISE);
    let of = |e: &f32| {
        let share = (e - ABOVE_NOISE * noise) / (e + HALF_TEXTURE * HALF_TEXTURE);
        // `max` first: it turns NaN into 0.
        share.max(0.0).clamp(0.0, 1.0)
    };
    energy.iter().map(of).collect()
}

/// `[h, w]`, inverse depth without steps that the photo does not show; 0 where the Gaussians have none. `None` without any depth.
fn smoothed(
    view: &View,
    map: &DepthMap,
    texture: &[f32],
    voxel: f32,
    length: f32,
) -> Option<Vec<f32>> {
    // Smoothness and data balance over (λ / w)^(1/4) pixels.
    let length_px = length * view.longer_side() as f32;
    let least_weight = (SMOOTHNESS / length_px.powi(4)).clamp(1e-6, 1.0);
    let mut depths: Vec<f32> = map.depth.iter().copied().filter(|z| *z > 0.0).collect();
    let median = upper_median(&mut depths, f32::total_cmp)?;
    let (middle, sigma) = (1.0 / median, voxel / (median * median));
    let value = |k: usize| {
        let z = map.depth[k];
        let w = (texture[k] * texture[k]).max(least_weight);
        if z > 0.0 { ((1.0 / z - middle) / sigma, w) } else { (0.0, 0.0) }
    };
    let finest = Grid::halved(view.width, view.height, |k| (value(k), view.luma[k]));
    let mut grids = vec![finest];
    while grids.last().is_some_and(|g| g.width.min(g.height) >= 2 * COARSEST) {
        let last = &grids[grids.len() - 1];
        let coarser = Grid::halved(last.width, last.height, |k| {
            ((last.data[k], last.weight[k]), last.luma[k])
        });
        grids.push(coarser);
    }
    let mut found: Option<Vec<f32>> = None;
    for (level, grid) in grids.iter().enumerate().rev() {
        let (start, scales) = match found.take() {
            Some(coarse) => (grid.enlarged(&grids[level + 1], &coarse), &CLOSED[..]),
            None => (grid.data.clone(), &CLOSING[..]),
        };
        // A pixel of this grid is `side` pixels of the photo wide: second differences are `side²` derivatives.
        let side = (2usize << level) as f32;
        // A crease costs the same on every grid.
        let widths = [OUTLIER, BEND * side.powf(1.5)];
        found = Some(relaxed(grid, start, SMOOTHNESS / side.powi(4), widths, scales));
    }
    let (finest, found) = (grids.first()?, found?);
    let of = |k: usize| {
        if !(map.depth[k] > 0.0) {
            return 0.0;
        }
        let at = [k % view.width, k / view.width].map(|v| (v as f32 + 0.5) * 0.5 - 0.5);
        let u = finest.between(&found, at).map_or(0.0, |v| middle + v * sigma);
        // Nothing is smoothed to behind the camera, or to a tenth of what it was.
        let most = 10.0 / map.depth[k];
        if u > 0.1 / map.depth[k] && u < most { u } else { 0.0 }
    };
    Some((0..map.depth.len()).map(of).collect())
}

/// The minimum near `start`.
fn relaxed(
    grid: &Grid,
    start: Vec<f32>,
    smoothness: f32,
    widths: [f32; 2],
    scales: &[f32],
) -> Vec<f32> {
    let mut u = start;
    for &scale in scales {
        let system = grid.weighted(&u, smoothness, widths.map(|w| w * scale));
        let at = system.product(&u);
        let rest = system.right().zip(&at).map(|(b, a)| b - a).collect();
        let step = solve(rest, |v| system.product(v), ITERATIONS);
        u.iter_mut().zip(step).for_each(|(u, s)| *u += s);
    }
    u
}

#[cfg(test)]
mod tests;
