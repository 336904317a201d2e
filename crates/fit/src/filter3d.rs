//! The 3D smoothing filter: no Gaussian finer than the photos can show.
//!
//! A photo samples a surface at depth `z` every `z / f` world units; a Gaussian thinner than
//! `sqrt(0.2)` of the finest such step is detail nobody has seen, which shows when a view zooms
//! in. The filter is that width, added in quadrature to the scales (Yu et al. 2024).

use glam::Vec3;
use motes_raster::ViewTransform;
use motes_scene::Gaussians;
use rayon::prelude::*;

/// Filter width in steps of the finest sampling: the variance of 0.2 of Mip-Splatting.
const WIDTH: f32 = 0.447_213_6;

/// Standard deviation of the filter per Gaussian, world units; for a Gaussian that no view sees,
/// that of the coarsest seen one.
pub(crate) fn filter_widths(gaussians: &Gaussians, views: &[&ViewTransform]) -> Vec<f32> {
    let mut widths: Vec<f32> = gaussians
        .means
        .par_iter()
        .map(|mean| {
            let steps = views.iter().filter_map(|view| sampling_step(view, Vec3::from(*mean)));
            steps.fold(f32::INFINITY, f32::min) * WIDTH
        })
        .collect();
    let coarsest = widths.iter().copied().filter(|w| w.is_finite()).fold(0.0, f32::max);
    for width in &mut widths {
        if !width.is_finite() {
            *width = coarsest;
        }
    }
    widths
}

/// World units per pixel at `mean`, when the view shows it (with 15 % around the image).
fn sampling_step(view: &ViewTransform, mean: Vec3) -> Option<f32> {
    let p = view.rotation * (mean - view.center);
    if !(p.z > 0.0) {
        return None;
    }
    let inside = (0..2).all(|axis| {
        let pixel = view.focal[axis] * p[axis] / p.z + view.principal[axis];
        let size = view.size[axis] as f32;
        pixel > -0.15 * size && pixel < 1.15 * size
    });
    inside.then(|| p.z / view.focal[0].max(view.focal[1]))
}

/// Folds the filter into scales and opacities, so that any renderer shows the same.
pub(crate) fn bake(gaussians: &mut Gaussians, widths: &[f32]) {
    for (i, &width) in widths.iter().enumerate() {
        let mut ratio = 1.0f64;
        for s in &mut gaussians.log_scales[i] {
            let variance = f64::from(*s * 2.0).exp();
            let smoothed = variance + f64::from(width).powi(2);
            ratio *= variance / smoothed;
            *s = (0.5 * smoothed.ln()) as f32;
        }
        let opacity = motes_math::sigmoid::sigmoid(gaussians.opacity_logits[i]);
        gaussians.opacity_logits[i] = motes_math::sigmoid::logit(opacity * ratio.sqrt() as f32);
    }
}
