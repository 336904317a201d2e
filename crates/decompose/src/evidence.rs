//! What the points of a scene say before anything is fitted, and about the scale.

use glam::Vec3;
use motes_shading::brdf::{Lobes, Material};
use motes_shading::environment::Environment;
use motes_shading::integrate::{IntegrationOptions, SurfacePoint};

use crate::decompose::Known;
use crate::materials::basis::BasisScene;
use crate::materials::find::FoundMaterials;
use crate::observed::Observed;
use crate::samples::{Sample, SeenView};

pub(crate) fn median_distance(samples: &[Sample], views: &[SeenView<'_>]) -> f32 {
    let mut all: Vec<f32> = samples
        .iter()
        .flat_map(|s| {
            s.observations.iter().map(|o| (views[o.photo as usize].rays.eye - s.position).length())
        })
        .collect();
    all.sort_by(f32::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(1.0)
}

/// Factor on the light that makes the base colours at anchors what they are known to be.
pub(crate) fn anchored(
    samples: &[Sample],
    found: &FoundMaterials,
    anchors: &[(Vec3, Vec3)],
) -> Option<Vec3> {
    let mut sum = Vec3::ZERO;
    for (position, known) in anchors {
        let mut near: Vec<(f32, usize)> = samples
            .iter()
            .enumerate()
            .map(|(p, s)| ((s.position - *position).length_squared(), p))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let few = &near[..near.len().min(8)];
        let mean = few.iter().map(|(_, p)| found.base_color_linear[*p]).sum::<Vec3>()
            / few.len().max(1) as f32;
        sum += Vec3::from(
            (mean.max(Vec3::splat(1e-3)) / known.max(Vec3::splat(1e-3))).to_array().map(f32::ln),
        );
    }
    (!anchors.is_empty()).then(|| Vec3::from((sum / anchors.len() as f32).to_array().map(f32::exp)))
}

/// Mean share of the irradiance that comes from the surface itself.
pub(crate) fn share_of_bounce(
    seen: &Observed<'_>,
    lights: &[Environment],
    ray_bias: f32,
    seed: u64,
) -> f32 {
    let Observed { scene, samples, vertex_radiance, .. } = seen;
    let options = IntegrationOptions {
        light_samples: 16,
        brdf_samples: 16,
        ray_bias,
        seed,
        ..IntegrationOptions::default()
    };
    let basis = BasisScene { scene, lights, vertex_radiance, lobes: Lobes::Lambert, options };
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

/// Logarithm of predicted base colours at the samples, mean over the photos that have a prediction.
pub(crate) fn prior_log_base(
    samples: &[Sample],
    views: &[SeenView<'_>],
    known: &Known,
) -> Option<Vec<Vec3>> {
    if !known.base_color_priors.iter().any(Option::is_some) {
        return None;
    }
    let of = |sample: &Sample| {
        let (mut sum, mut count) = (Vec3::ZERO, 0.0f32);
        for o in &sample.observations {
            let k = o.photo as usize;
            let Some(Some(image)) = known.base_color_priors.get(k) else { continue };
            let Some((x, y, _)) = views[k].rays.project(sample.position) else { continue };
            let pixel =
                image.pixel((x as usize).min(image.width - 1), (y as usize).min(image.height - 1));
            sum += Vec3::from([pixel[0], pixel[1], pixel[2]].map(|v| v.max(1e-3).ln()));
            count += 1.0;
        }
        if count > 0.0 { sum / count } else { Vec3::ZERO }
    };
    Some(samples.iter().map(of).collect())
}
