//! What points tell about the light beside their shading: light from the surface itself, predicted base colors.

use glam::Vec3;
use motes_scene::ImageF32;
use motes_shading::brdf::{Lobes, Material};
use motes_shading::integrate::{IntegrationOptions, SurfacePoint};

use crate::appearance::BasisScene;
use crate::observation::{Observed, Sample, SeenView};
use crate::state::State;

/// Mean share of the irradiance that comes from the surface itself.
pub(crate) fn share_of_bounce(state: &State<'_>) -> f32 {
    let Observed { scene, samples, vertex_radiance, .. } = &state.observed;
    let lights = &state.illumination.lights;
    let (ray_bias, seed) = (state.ray_bias(), state.inputs.seed);
    let options = IntegrationOptions {
        light_samples: 16,
        brdf_samples: 16,
        ray_bias,
        seed,
        ..IntegrationOptions::default()
    };
    let emitters = state.illumination.emitters(scene);
    let (emitters, lobes) = (emitters.as_ref(), Lobes::Lambert);
    let basis = BasisScene { scene, lights, vertex_radiance, emitters, lobes, options };
    let points: Vec<SurfacePoint> = samples
        .iter()
        .map(|s| SurfacePoint {
            position: s.position,
            geometric_normal: s.geometric_normal,
            shading_normal: s.normal,
            to_viewer: s.normal,
            material: Material::lambert(Vec3::ONE),
        })
        .collect();
    basis.with_shaders(|shaders| {
        let shaded = shaders[0].shade(&points, 0);
        let (sum, total) = shaded.iter().fold((0.0f32, 0.0f32), |(i, t), s| {
            (i + s.indirect.element_sum(), t + s.total().element_sum())
        });
        if total > 0.0 { sum / total } else { 0.0 }
    })
}

/// Logarithm of predicted base colors at the samples, mean over the photos that have a prediction.
pub(crate) fn prior_log_base(
    samples: &[Sample],
    views: &[SeenView<'_>],
    priors: &[Option<ImageF32>],
) -> Option<Vec<Vec3>> {
    if !priors.iter().any(Option::is_some) {
        return None;
    }
    let of = |sample: &Sample| {
        let (mut sum, mut count) = (Vec3::ZERO, 0.0f32);
        for o in &sample.observations {
            let k = o.photo as usize;
            let Some(Some(image)) = priors.get(k) else { continue };
            let Some((x, y, _)) = views[k].rays.project(sample.position) else { continue };
            let pixel =
                image.pixel((x as usize).min(image.width - 1), (y as usize).min(image.height - 1));
            // Negative: nothing was predicted.
            if pixel.iter().any(|v| *v < 0.0) {
                continue;
            }
            sum += Vec3::from([pixel[0], pixel[1], pixel[2]].map(|v| v.max(1e-3).ln()));
            count += 1.0;
        }
        if count > 0.0 { sum / count } else { Vec3::ZERO }
    };
    Some(samples.iter().map(of).collect())
}
