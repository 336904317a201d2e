//! What points tell about the light beside their shading: light from the surface itself, predicted base colors.

use glam::Vec3;
use motes_scene::ImageF32;
use motes_shading::brdf::{Lobes, Material};
use motes_shading::integrate::{IntegrationOptions, SurfacePoint};

use crate::appearance::BasisScene;
use crate::observation::{Observation, Observed, Sample, SeenView};
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
/// Share of the photo's difference that a prediction may leave to the light, from which it explains nothing.
const UNEXPLAINED: f32 = 0.5;

/// How far a prediction lets two points have one base color, 0 to 1, from the difference of its logarithms there and that of the photos.
///
/// A prediction counts where it explains what the photos show: on a texture both differ alike. Predictors leave a part of the shading
/// in the base color; such a part, taken at its word, would move the shadow's edge, which tells the light, into the base color. What
/// has nothing to do with the photos explains nothing either.
pub(crate) fn likeness(predicted: Vec3, shown: Vec3) -> f32 {
    let left = (shown - predicted).length() / (UNEXPLAINED * shown.length()).max(f32::MIN_POSITIVE);
    if left.is_nan() || left >= 1.0 {
        return 1.0;
    }
    let unlike = (predicted.abs().max_element() / UNLIKE).powi(2);
    1.0 - (1.0 - left * left) * unlike / (1.0 + unlike)
}

/// Rounds of [`aligned`].
const ALIGNMENT_ROUNDS: usize = 8;

/// Logarithm of predicted base colors at the samples, mean over the photos that have a prediction. Photos are brought to one
/// exposure first, per channel: every one is predicted up to a factor of its own.
pub(crate) fn prior_log_base(
    samples: &[Sample],
    views: &[SeenView<'_>],
    priors: &[Option<ImageF32>],
) -> Option<Vec<Vec3>> {
    if !priors.iter().any(Option::is_some) {
        return None;
    }
    let seen_in = |sample: &Sample, o: &Observation| {
        let image = priors.get(o.photo as usize)?.as_ref()?;
        let (x, y, _) = views[o.photo as usize].rays.project(sample.position)?;
        let pixel =
            image.pixel((x as usize).min(image.width - 1), (y as usize).min(image.height - 1));
        // Negative: nothing was predicted.
        let is_predicted = pixel.iter().all(|v| *v >= 0.0);
        let log = Vec3::from([pixel[0], pixel[1], pixel[2]].map(|v| v.max(1e-3).ln()));
        is_predicted.then_some((o.photo as usize, log))
    };
    let of =
        |sample: &Sample| sample.observations.iter().filter_map(|o| seen_in(sample, o)).collect();
    Some(aligned(&samples.iter().map(of).collect::<Vec<_>>(), views.len()))
}

/// Means of the values of every point less the offset of the photo that they are from, least squares of both by turns; 0 of none.
fn aligned(values: &[Vec<(usize, Vec3)>], photos: usize) -> Vec<Vec3> {
    let mut offsets = vec![Vec3::ZERO; photos];
    let mut means = vec![Vec3::ZERO; values.len()];
    for _ in 0..ALIGNMENT_ROUNDS {
        let mut sums = vec![(Vec3::ZERO, 0.0f32); photos];
        for (mean, values) in means.iter_mut().zip(values) {
            let sum: Vec3 = values.iter().map(|(photo, value)| *value - offsets[*photo]).sum();
            *mean = sum / values.len().max(1) as f32;
            for (photo, value) in values {
                sums[*photo].0 += *value - *mean;
                sums[*photo].1 += 1.0;
            }
        }
        offsets = sums.into_iter().map(|(sum, count)| sum / count.max(1.0)).collect();
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prediction_counts_where_it_explains_the_photos() {
        let edge = Vec3::new(0.9, 1.0, 1.1);
        // Nothing predicted, or nothing to explain.
        assert_eq!(likeness(Vec3::ZERO, edge), 1.0);
        assert_eq!(likeness(edge, Vec3::ZERO), 1.0);
        // A texture that both show, and a part of the shading that was left in the base color.
        assert!(likeness(edge, edge) < 0.1 && likeness(-edge, -edge) == likeness(edge, edge));
        assert_eq!(likeness(0.4 * edge, edge), 1.0);
        // Something else entirely, and what is out of range.
        assert_eq!(likeness(Vec3::new(-1.0, 1.0, 0.0), edge), 1.0);
        for wild in [f32::MAX, f32::NAN, f32::INFINITY] {
            assert!((0.0..=1.0).contains(&likeness(Vec3::splat(wild), edge)), "{wild}");
        }
    }

    #[test]
    fn photos_predicted_at_scales_of_their_own_are_brought_together() {
        let truth = [0.0, 1.0, -0.5, 0.3].map(Vec3::splat);
        let offsets = [Vec3::splat(0.7), Vec3::new(-0.4, 0.2, 0.0), Vec3::ZERO];
        let sees = [[0, 1], [1, 2], [0, 2], [0, 1]];
        let values: Vec<Vec<(usize, Vec3)>> = (0..40)
            .map(|k| sees[k % 4].iter().map(|p| (*p, truth[k % 4] + offsets[*p])).collect())
            .collect();
        let means = aligned(&values, 3);
        for k in 1..4 {
            let error = (means[k] - means[0]) - (truth[k] - truth[0]);
            assert!(error.abs().max_element() < 0.02, "{k}: {error}");
        }
        assert_eq!(aligned(&[vec![]], 0), [Vec3::ZERO]);
    }
}
