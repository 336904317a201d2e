//! Colors fitted to relit views, geometry fixed.
//!
//! A picture is linear in the harmonics, `color(p) = Σ_i w_ip Σ_k Y_k(d_i) sh_ik`, and `Σ_i w_ip <= 1`, so
//!
//! ```text
//! sh_ik <- sh_ik - (1 / D_ik) ∂/∂sh_ik ½ Σ_v Σ_p ω_v ω(p) |color(p) - target(p)|²
//! D_ik  = Σ_v ω_v |Y_k| (Σ_j |Y_j|) Σ_p w_ip + λ
//! ```
//!
//! never overshoots (separable surrogates, Erdogan & Fessler 1999); Nesterov's momentum makes it fast. The weights
//! `ω(p) = 1 / (1 + (e / σ)²)²` (Geman & McClure 1985) are those of the step before.

use motes_math::sh::{sh_basis, sh_coefficients};
use motes_raster::{
    Antialias, Frame, GaussianGradients, Modifiers, Planes, RenderOptions, ViewTransform,
};
use motes_scene::{Gaussians, ImageF32};

use super::consensus::OfView;
use super::votes::BackProjection;
use super::{Agreement, LiftOptions, RelitView};
use motes_math::srgb;

/// Residual, encoded, from which on a pixel counts less.
const SIGMA: f32 = 0.1;
/// Pull toward the voted color, pixels: what no view sees keeps it.
const PULL: f32 = 0.5;

/// Fits in place; root mean square errors of the first and the last step.
pub(super) fn refit(
    gaussians: &mut Gaussians,
    antialias: Antialias,
    views: &[RelitView],
    judged: &[OfView],
    options: &LiftOptions,
) -> [f64; 2] {
    // Bands above the fitted degree would keep the reflections of the old light.
    *gaussians = gaussians.with_sh_degree(options.refit_degree);
    let targets: Vec<ImageF32> = views.iter().zip(judged).map(target).collect();
    let robust = options.agreement == Agreement::Robust;
    let scale = surrogate(gaussians, antialias, views, judged);
    let anchor = gaussians.sh.clone();
    let (mut at, mut last) = (anchor.clone(), anchor.clone());
    let render = RenderOptions { antialias, ..RenderOptions::default() };
    let (mut frame, mut gradients) = (Frame::new(), GaussianGradients::default());
    let (mut momentum, mut errors) = (1.0f32, [0.0f64; 2]);
    for step in 0..options.refit_steps {
        let mut sum = vec![0.0f32; at.len()];
        let (mut error, mut weights) = (0.0f64, 0.0f64);
        gaussians.sh.copy_from_slice(&at);
        for ((view, target), of) in views.iter().zip(&targets).zip(judged) {
            if !(of.weight > 0.0) {
                continue;
            }
            let transform = ViewTransform::new(&view.camera, &view.camera_from_world);
            let none = Modifiers::default();
            let drawn = frame.forward(gaussians, &transform, &none, &render).to_image(0, 3);
            let (gradient, e, w) = residual(&drawn, target, view, of.weight, robust);
            error += e;
            weights += w;
            frame.backward(gaussians, &none, &render, &gradient, &mut gradients);
            sum.iter_mut().zip(&gradients.sh).for_each(|(s, g)| *s += g);
        }
        let rms = (error / weights.max(1e-12)).sqrt();
        if step == 0 {
            errors[0] = rms;
        }
        errors[1] = rms;
        let next_momentum = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
        let carry = (momentum - 1.0) / next_momentum;
        momentum = next_momentum;
        for i in 0..at.len() {
            let pull = PULL * (at[i] - anchor[i]);
            let now = at[i] - (sum[i] + pull) / (scale[i] + PULL);
            at[i] = now + carry * (now - last[i]);
            last[i] = now;
        }
    }
    gaussians.sh = last;
    errors
}

/// The relit view without its own gain, sRGB-encoded.
fn target((view, of): (&RelitView, &OfView)) -> ImageF32 {
    let mut image = view.picture.clone();
    for pixel in image.data.chunks_exact_mut(3) {
        for (value, gain) in pixel.iter_mut().zip(of.gain) {
            *value = srgb::encode(srgb::decode(*value) / gain.exp());
        }
    }
    image
}

fn residual(
    drawn: &ImageF32,
    target: &ImageF32,
    view: &RelitView,
    view_weight: f32,
    robust: bool,
) -> (Planes, f64, f64) {
    let mut image = ImageF32::filled(drawn.width, drawn.height, 3, 0.0);
    let (mut error, mut weights) = (0.0f64, 0.0f64);
    for i in 0..drawn.pixel_count() {
        let e = [0, 1, 2].map(|c| drawn.data[3 * i + c] - target.data[3 * i + c]);
        let square = e.iter().map(|e| e * e).sum::<f32>() / 3.0;
        let mut weight = view_weight * view.mask.as_ref().map_or(1.0, |mask| mask.data[i]);
        if robust {
            weight *= (1.0 + square / (SIGMA * SIGMA)).powi(-2);
        }
        if !(weight > 0.0) {
            continue;
        }
        error += f64::from(weight * square);
        weights += f64::from(weight);
        (0..3).for_each(|c| image.data[3 * i + c] = weight * e[c]);
    }
    let mut planes = Planes::new(drawn.width, drawn.height, 4);
    (0..3).for_each(|c| planes.set_plane(c, &image, c));
    (planes, error, weights)
}

/// `D_ik` without its constant, one per harmonic and channel.
fn surrogate(
    gaussians: &Gaussians,
    antialias: Antialias,
    views: &[RelitView],
    judged: &[OfView],
) -> Vec<f32> {
    let k = sh_coefficients(gaussians.sh_degree);
    let mut scale = vec![0.0f32; gaussians.sh.len()];
    for (view, of) in views.iter().zip(judged) {
        let ones = ImageF32::filled(view.camera.width, view.camera.height, 3, of.weight);
        let sums = BackProjection::new(gaussians, antialias, view).sums(&ones);
        let eye = view.camera_from_world.center_in_world().as_vec3();
        for (i, sum) in sums.iter().enumerate().filter(|(_, sum)| sum[0] > 0.0) {
            let direction = (glam::Vec3::from(gaussians.means[i]) - eye).normalize_or_zero();
            let mut basis = [0.0f32; 25];
            sh_basis(gaussians.sh_degree, direction.to_array(), &mut basis);
            let total: f32 = basis[..k].iter().map(|y| y.abs()).sum();
            for (j, out) in scale[3 * k * i..3 * k * (i + 1)].chunks_exact_mut(3).enumerate() {
                out.iter_mut().for_each(|o| *o += basis[j].abs() * total * sum[0]);
            }
        }
    }
    scale
}
