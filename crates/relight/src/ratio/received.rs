//! Light that a white matte Gaussian would receive.

use glam::Vec3;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};

use crate::lamps::Lights;
use crate::scene::RelightScene;
use crate::surface_point::white_matte;

/// Keeps the random numbers apart from those of pixels, vertices and baked colors.
const FIRST_ITEM: u64 = 1 << 52;

/// Radiance of a white Lambert surface at `position` with `normal`, for every Gaussian; direct light with shadows.
pub(super) fn received(
    scene: &RelightScene,
    light: &Lights<'_>,
    places: &[(Vec3, Vec3)],
    samples: u32,
    seed: u64,
) -> Vec<Vec3> {
    let points: Vec<SurfacePoint> =
        places.iter().map(|&(position, normal)| white_matte(position, normal)).collect();
    let options = IntegrationOptions {
        light_samples: samples,
        brdf_samples: samples / 2,
        ray_bias: scene.ray_bias,
        seed,
        ..IntegrationOptions::default()
    };
    let shader =
        Shader::new(light.environment, &scene.tracer, None, options).with_emitters(light.lamps);
    shader.shade(&points, FIRST_ITEM).iter().map(|s| s.total()).collect()
}
