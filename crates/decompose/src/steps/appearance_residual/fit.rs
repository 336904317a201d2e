//! What the model of a scene leaves unexplained under its own light, put on the Gaussians.
//!
//! Shape, materials and light that were found explain the photos only so far. What is left has a pattern: it stays where it is,
//! and changes slowly with the direction of view. It is fitted as the logarithm of a factor on the model's pictures `M`:
//!
//! ```text
//! shown = encode(M exp(ρ)),   ρ = Σ α T SH_i(direction)
//! cost  = mean w (sqrt((shown - photo)² + ε²) - ε)
//! ```
//!
//! A factor, since errors of visibility, normals and of the scale of materials multiply. Shapes and opacities stay; Adam moves the
//! harmonics from 0, so Gaussians that no photo sees have none.

use half::f16;
use motes_math::srgb;
use motes_raster::{Frame, GaussianGradients, Modifiers, Planes, RenderOptions, ViewTransform};
use motes_scene::{Gaussians, LARGEST_LOG_RATIO, Pinhole, Pose, Residual};
use train_splat::{FitOptions, FreezeGroup, Moments, PhotoOrder, Rates, Update};

use crate::image_gradient::slopes;
use crate::observation::Radiance;

/// Differences below this are noise, sRGB-encoded.
const NOISE: f32 = 0.01;
/// Of the rates, at the last step.
const LAST: f64 = 0.1;
/// Rates at the first step, of band 0 and of the others: log ratios are small and start at 0.
const RATES: [f64; 2] = [0.04, 0.02];
/// The model tells nothing where it is darker than this, linear.
const LEAST_MODEL: f32 = 1e-4;
const PURPOSE: u64 = 0x5245_5349;

/// A photo and what the model shows in its place.
#[derive(Clone, Debug)]
pub(super) struct ResidualView<'a> {
    /// Of the photo.
    pub camera: Pinhole,
    /// Of the photo.
    pub camera_from_world: Pose,
    /// `[h, w, 3]`, linear, photo units.
    pub photo_linear: &'a Radiance,
    /// Row by row: `false` where the photo is masked or clipped.
    pub usable: &'a [bool],
    /// `[h, w, 3]`, linear, photo units; 0 where the model says nothing. Half precision: all photos' are kept at once.
    pub model_linear: &'a [f16],
}

/// How a residual is fitted.
#[derive(Clone, Copy, Debug)]
pub(super) struct ResidualOptions {
    /// Of the spherical harmonics, 0 to 4.
    pub degree: u8,
    /// Steps, one photo each.
    pub steps: u32,
    /// Key of the order of the photos.
    pub seed: u64,
}

/// Fits the residual of `views` to the Gaussians.
///
/// # Errors
/// What `observer` says, which gets the share of the steps that are done.
pub(super) fn fit_residual<E>(
    gaussians: &Gaussians,
    views: &[ResidualView<'_>],
    render: &RenderOptions,
    options: &ResidualOptions,
    mut observer: impl FnMut(f32) -> Result<(), E>,
) -> Result<Residual, E> {
    use FreezeGroup::{Geometry, Opacities};
    let mut model =
        Gaussians { sh: Vec::new(), sh_degree: 0, extra: Vec::new(), ..gaussians.clone() };
    model.sh = vec![0.0; 3 * model.len()];
    let mut model = model.with_sh_degree(options.degree);
    let mut moments = Moments::zeros(&model);
    let fit = FitOptions {
        freeze: vec![Geometry, Opacities],
        lr_sh0: RATES[0],
        lr_sh_rest: RATES[1],
        ..FitOptions::default()
    };
    let (mut frame, mut gradients) = (Frame::new(), GaussianGradients::default());
    let none = Modifiers::default();
    let mut order = PhotoOrder::new(views.len(), options.seed, PURPOSE);
    for step in 0..options.steps {
        let Some(v) = order.at(step) else { break };
        observer(step as f32 / options.steps as f32)?;
        let view = &views[v];
        let transform = ViewTransform::new(&view.camera, &view.camera_from_world);
        let slope = slope(view, frame.forward(&model, &transform, &none, render));
        frame.backward(&model, &none, render, &slope, &mut gradients);
        let progress = f64::from(step) / f64::from(options.steps);
        let rates = Rates::at(&fit, 1.0, LAST.powf(progress), progress);
        let sh_degree = options.degree;
        let update = Update { step: u64::from(step) + 1, sh_degree, sh_every: 1, sparse: true };
        moments.apply(&mut model, &gradients, &rates, &update);
    }
    model.sh.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = 0.0);
    Ok(Residual::from_drawn(&model))
}

/// Slope of the cost by every value of the picture that is drawn.
fn slope(view: &ResidualView<'_>, image: &Planes) -> Planes {
    let seen = view.photo_linear.turned(|_, v| srgb::encode(v));
    slopes([image.width, image.height], |x, y| {
        let i = y * image.width + x;
        let alpha = 1.0 - image.row(3, y)[x];
        [0, 1, 2].map(|c| {
            // A photo shows nothing above 1.
            let model = view.model_linear[3 * i + c].to_f32().min(1.0);
            if !(view.usable[i] && model > LEAST_MODEL) {
                return 0.0;
            }
            let log_ratio = Residual::log_ratio(image.row(c, y)[x], alpha);
            slope_by_drawn(model, log_ratio, seen.at(i, c))
        })
    })
}

/// Derivative of the cost of one value by the color that is drawn.
fn slope_by_drawn(model: f32, log_ratio: f32, seen: f32) -> f32 {
    let radiance = model * log_ratio.exp();
    let (shown, by_radiance) = srgb::encode_with_slope(radiance);
    let off = shown - seen;
    let by_shown = off / (off * off + NOISE * NOISE).sqrt();
    by_shown * by_radiance * radiance * 2.0 * LARGEST_LOG_RATIO
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use motes_scene::ImageF32;

    use super::*;

    #[test]
    fn slopes_are_those_of_finite_differences() {
        let encode = |v: f64| {
            if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
        };
        for model in [1e-3, 0.05, 0.4, 3.0] {
            for drawn in [0.2, 0.5, 0.9] {
                for seen in [0.0, 0.3, 0.95] {
                    let cost = |drawn: f64| {
                        let log_ratio = 2.0 * f64::from(LARGEST_LOG_RATIO) * (drawn - 0.5);
                        (encode(f64::from(model) * log_ratio.exp()) - f64::from(seen))
                            .hypot(f64::from(NOISE))
                    };
                    let (at, h) = (f64::from(drawn), 1e-6);
                    let numeric = (cost(at + h) - cost(at - h)) / (2.0 * h);
                    let log_ratio = Residual::log_ratio(drawn, 1.0);
                    let found = f64::from(slope_by_drawn(model, log_ratio, seen));
                    let off = (found - numeric).abs();
                    assert!(off < 2e-3 * numeric.abs().max(1e-2), "{numeric} {found}");
                }
            }
        }
        assert!(slope_by_drawn(1e30, LARGEST_LOG_RATIO, 1.0).is_finite());
    }

    /// A model that is wrong by factors which depend on the side: the residual makes the pictures right, also from between the
    /// photos; without steps and without views there is none.
    #[test]
    fn a_factor_that_changes_with_the_view_is_found() {
        let gaussians = motes_testkit::random_gaussians(60, 40, 0);
        let render = RenderOptions::default();
        let camera = motes_testkit::small_camera(48, 32);
        let poses: Vec<Pose> = (0..7).map(|k| motes_testkit::orbit_pose(k as f64 * 0.15)).collect();
        let truth = |k: usize| {
            let ratio = 0.5 + 0.1 * k as f32;
            ImageF32::filled(48, 32, 3, 0.3 * ratio)
        };
        let usable = vec![true; 48 * 32];
        let model = vec![f16::from_f32(0.3); 3 * 48 * 32];
        let photos: Vec<Radiance> = (0..7).map(|k| truth(k).into()).collect();
        let views: Vec<ResidualView<'_>> = [0, 1, 2, 4, 5, 6]
            .into_iter()
            .map(|k| ResidualView {
                camera,
                camera_from_world: poses[k],
                photo_linear: &photos[k],
                usable: &usable,
                model_linear: &model,
            })
            .collect();
        let fit = |views: &[ResidualView<'_>], degree, steps| {
            let options = ResidualOptions { degree, steps, seed: 3 };
            match fit_residual(&gaussians, views, &render, &options, |_| Ok::<(), Infallible>(())) {
                Ok(residual) => residual,
                Err(never) => match never {},
            }
        };
        let error = |residual: &Residual| {
            let drawn =
                motes_raster::render(&residual.drawn(&gaussians), &camera, &poses[3], &render);
            let mut sums = [0.0, 0.0];
            for (i, alpha) in drawn.alpha.data.iter().enumerate().filter(|(_, a)| **a > 0.9) {
                let log_ratio = Residual::log_ratio(drawn.color.data[3 * i], *alpha);
                sums[0] += (0.3 * log_ratio.exp() - photos[3].at(0).x).abs();
                sums[1] += 1.0;
            }
            assert!(sums[1] > 50.0, "pixels: {}", sums[1]);
            sums[0] / sums[1]
        };
        let (all, nothing) = (fit(&views, 2, 240), fit(&views, 2, 0));
        let (all, before) = (error(&all), error(&nothing));
        assert!(all < 0.3 * before, "{before} {all}");
        assert!(nothing.log_ratio_sh.iter().all(|v| *v == 0.0));
        assert!(fit(&[], 1, 9).log_ratio_sh.iter().all(|v| *v == 0.0));
    }
}
