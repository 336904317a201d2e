//! One color per Gaussian from pictures of colors.
//!
//! A rendered picture is linear in the colors of the Gaussians: `R = Σ_i α_i T_i b_i`. Simultaneous iterative
//! reconstruction (Gilbert 1972) with momentum: every Gaussian moves by the mean residual of its pixels, weighted by
//! `α T` and by the pixel, and residuals that other views contradict count less and less (Geman & McClure 1987).

use glam::Vec3;
use half::f16;
use motes_math::sh;
use motes_raster::{Frame, GaussianGradients, Modifiers, Planes, RenderOptions, ViewTransform};
use motes_scene::{Gaussians, Pinhole, Pose};

use crate::appearance::half_pixels::HalfPixels;

/// A picture of colors, seen from somewhere.
#[derive(Debug)]
pub(crate) struct ColorTarget {
    /// Camera.
    pub camera: Pinhole,
    /// Its place.
    pub camera_from_world: Pose,
    /// Row by row, 0 to 1, in the space that Gaussians are blended in: sRGB-encoded.
    pub color: HalfPixels,
    /// Row by row.
    pub weight: Vec<f16>,
}

/// Colors of the Gaussians and how well they are known.
#[derive(Debug)]
pub(crate) struct FittedColors {
    /// One per Gaussian, 0 to 1, sRGB-encoded.
    pub colors: Vec<Vec3>,
    /// Views in which it is responsible for more than a thousandth of a pixel, `Σ w α T`.
    pub observations: Vec<u16>,
}

const SH_C0: f32 = sh::SH_C0 as f32;
/// Residuals beyond this hardly count, in units of the color.
const OUTLIER: f32 = 0.2;
/// Share of the last move that is repeated.
const MOMENTUM: f32 = 0.6;
/// Darkest color: below it the rasterizer's clamp would stop a gradient.
const DARKEST: f32 = 0.004;
/// Least opacity of a pixel that is compared.
const MIN_ALPHA: f32 = 0.5;

/// The colors of `gaussians` of degree 0, 0 to 1.
pub(crate) fn colors_of(gaussians: &Gaussians) -> Vec<Vec3> {
    let color = |sh: &[f32]| Vec3::from_slice(sh) * SH_C0 + 0.5;
    gaussians.sh.chunks_exact(3).map(|sh| color(sh).clamp(Vec3::ZERO, Vec3::ONE)).collect()
}

/// Fits colors to `targets`, starting from `start`.
pub(crate) fn fit_colors(
    gaussians: &Gaussians,
    targets: &[ColorTarget],
    start: &[Vec3],
    passes: u32,
    options: &RenderOptions,
) -> FittedColors {
    let n = gaussians.len();
    let clamp = |c: Vec3| c.clamp(Vec3::splat(DARKEST), Vec3::ONE);
    let mut colors: Vec<Vec3> = start.iter().map(|&c| clamp(c)).collect();
    let mut moves = vec![Vec3::ZERO; n];
    let mut observations = vec![0u16; n];
    let mut frame = Frame::new();
    let mut gradients = GaussianGradients::default();
    for pass in 0..passes {
        let model = gaussians.colored(|i| colors[i].to_array());
        let (mut numerator, mut denominator) = (vec![Vec3::ZERO; n], vec![0.0f32; n]);
        for target in targets {
            let view = ViewTransform::new(&target.camera, &target.camera_from_world);
            let image = frame.forward(&model, &view, &Modifiers::default(), options).clone();
            let (residuals, weights) = residual_planes(&image, target, pass);
            frame.backward(&model, &Modifiers::default(), options, &residuals, &mut gradients);
            for (sum, sh) in numerator.iter_mut().zip(gradients.sh.chunks_exact(3)) {
                *sum += Vec3::from_slice(sh) / SH_C0;
            }
            frame.backward(&model, &Modifiers::default(), options, &weights, &mut gradients);
            for (i, sh) in gradients.sh.chunks_exact(3).enumerate() {
                denominator[i] += sh[0] / SH_C0;
                if pass == 0 && sh[0] / SH_C0 > 1e-3 {
                    observations[i] += 1;
                }
            }
        }
        for i in 0..n {
            if denominator[i] > 1e-6 {
                let step = numerator[i] / denominator[i] + moves[i] * MOMENTUM;
                let to = clamp(colors[i] + step);
                moves[i] = to - colors[i];
                colors[i] = to;
            }
        }
    }
    FittedColors { colors, observations }
}

/// `w (alpha target - rendered)` and `w`, as planes of gradients.
fn residual_planes(image: &Planes, target: &ColorTarget, pass: u32) -> (Planes, Planes) {
    let (w, h) = (image.width, image.height);
    let (mut residuals, mut weights) = (Planes::new(w, h, 4), Planes::new(w, h, 4));
    for y in 0..h {
        for x in 0..w {
            let alpha = 1.0 - image.row(3, y)[x];
            let mut weight = target.weight[y * w + x].to_f32();
            if !(weight > 0.0 && alpha > MIN_ALPHA) {
                continue;
            }
            let pixel = target.color.at(y * w + x);
            let residual: [f32; 3] = std::array::from_fn(|c| alpha * pixel[c] - image.row(c, y)[x]);
            // The first passes are for everybody: until colors settle, all residuals are large.
            if pass >= 3 {
                let square = residual.iter().map(|r| r * r).sum::<f32>() / (OUTLIER * OUTLIER);
                weight /= (1.0 + square).powi(2);
            }
            for (c, r) in residual.iter().enumerate() {
                residuals.row_mut(c, y)[x] = weight * r;
                weights.row_mut(c, y)[x] = weight;
            }
        }
    }
    (residuals, weights)
}
