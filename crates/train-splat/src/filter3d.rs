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

/// Gaussians per task.
const CHUNK: usize = 1024;

/// Standard deviation of the filter per Gaussian, world units; for a Gaussian that no view sees,
/// that of the coarsest seen one.
pub(crate) fn filter_widths(gaussians: &Gaussians, views: &[&ViewTransform]) -> Vec<f32> {
    let mut widths: Vec<f32> = gaussians
        .means
        .par_iter()
        .with_min_len(CHUNK)
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
    gaussians
        .log_scales
        .par_iter_mut()
        .zip(&mut gaussians.opacity_logits)
        .zip(widths)
        .with_min_len(CHUNK)
        .for_each(|((log_scales, opacity_logit), &width)| {
            let mut ratio = 1.0f64;
            for s in log_scales {
                let variance = f64::from(*s * 2.0).exp();
                let smoothed = variance + f64::from(width).powi(2);
                ratio *= variance / smoothed;
                *s = (0.5 * smoothed.ln()) as f32;
            }
            let opacity = motes_math::sigmoid::sigmoid(*opacity_logit);
            *opacity_logit = motes_math::sigmoid::logit(opacity * ratio.sqrt() as f32);
        });
}

#[cfg(test)]
mod tests {
    use motes_raster::{Frame, Modifiers, RenderOptions};
    use motes_testkit::{orbit_pose, random_gaussians, small_camera};

    use super::*;

    #[test]
    fn the_baked_model_renders_like_the_filtered_one() {
        let mut g = random_gaussians(4, 80, 1);
        let view = ViewTransform::new(&small_camera(64, 48), &orbit_pose(0.3));
        let widths = vec![0.07; 80];
        let modifiers = Modifiers { filter_3d: Some(&widths), opacity_gain: None };
        let options = RenderOptions::default();
        let filtered = Frame::new().forward(&g, &view, &modifiers, &options).clone();
        bake(&mut g, &widths);
        let mut frame = Frame::new();
        let baked = frame.forward(&g, &view, &Modifiers::default(), &options);
        for (a, b) in filtered.data.iter().zip(&baked.data) {
            assert!((a - b).abs() < 5e-3, "{a} {b}");
        }
    }

    #[test]
    fn widths_follow_the_nearest_view_that_sees_a_gaussian() {
        let mut g = random_gaussians(4, 2, 0);
        g.means = vec![[0.0; 3], [1000.0, 0.0, 1000.0]];
        let camera = small_camera(64, 48);
        let views: Vec<_> =
            [0.1, 1.0].map(|a| ViewTransform::new(&camera, &orbit_pose(a))).into_iter().collect();
        let widths = filter_widths(&g, &views.iter().collect::<Vec<_>>());
        let distance = (9.0f32 + 0.64).sqrt();
        let expected = distance / (1.1 * 64.0) * WIDTH;
        assert!((widths[0] - expected).abs() < 1e-3 * expected, "{} {expected}", widths[0]);
        // Nobody sees the second one: it gets the coarsest filter in use, not an infinite one.
        assert_eq!(widths[1], widths[0]);
    }
}
