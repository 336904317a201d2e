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

/// Difference of predicted base colors, in logarithms, from which two points hardly count as alike.
const UNLIKE: f32 = 0.25;

/// How far a prediction lets two points have one base color, 0 to 1, for the difference of its logarithms there.
///
/// A prediction says which points differ, not by how much: predictors leave a part of the shading in the base color, and differences
/// taken at their word would move that part out of the light.
pub(crate) fn likeness(difference: Vec3) -> f32 {
    1.0 / (1.0 + (difference.abs().max_element() / UNLIKE).powi(2))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_predicted_to_differ_count_less_and_never_more_than_without_a_prediction() {
        assert_eq!(likeness(Vec3::ZERO), 1.0);
        assert!((likeness(Vec3::new(0.0, -UNLIKE, 0.0)) - 0.5).abs() < 1e-6);
        // A factor of four in one channel, either way.
        let far = likeness(Vec3::X * 4f32.ln());
        assert!(far < 0.05 && far == likeness(-Vec3::X * 4f32.ln()));
        assert_eq!(likeness(Vec3::splat(f32::MAX)), 0.0);
    }
}
