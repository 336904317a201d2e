//! Light that the surface sends on: outgoing diffuse radiance at its vertices under one light.
//!
//! ```text
//! B_0 = albedo / π ∫ L V (n · w) dw           direct light, by samples
//! B_k = B_0 + albedo / π ∫ B_{k-1}(hit) (n · w) dw      where rays of the cosine lobe are blocked
//! ```
//!
//! A view that meets a vertex's triangle takes the interpolated `B`: as if everything it does not
//! see directly were diffuse. A metal's albedo is its base color.

use glam::Vec3;
use motes_shading::brdf::Material;
use motes_shading::environment::Environment;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};
use motes_shading::tracing::{Hit, Ray};
use rayon::prelude::*;

use crate::scene::RelightScene;

/// Keeps the random numbers of the passes apart from those of pixels.
const FIRST_ITEM: u64 = 1 << 40;

/// Outgoing radiance per vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct RadianceCache {
    outgoing: Vec<Vec3>,
}

impl RadianceCache {
    /// Gathers `bounces - 1` times from itself; `samples` directions each. No bounce, no cache.
    pub(crate) fn new(
        scene: &RelightScene,
        light: &Environment,
        bounces: u32,
        samples: u32,
        seed: u64,
    ) -> Self {
        if bounces == 0 || light.is_black() {
            return Self::default();
        }
        let surface = &scene.surface;
        let white = Material::lambert(Vec3::ONE);
        let points: Vec<SurfacePoint> = (0..surface.vertices.len())
            .map(|i| {
                let normal = Vec3::from(surface.normals[i]).normalize_or(Vec3::Z);
                SurfacePoint {
                    position: Vec3::from(surface.vertices[i]),
                    geometric_normal: normal,
                    shading_normal: normal,
                    to_viewer: normal,
                    material: white,
                }
            })
            .collect();
        let options = IntegrationOptions {
            light_samples: samples,
            brdf_samples: samples / 4,
            ray_bias: scene.ray_bias,
            seed,
            ..IntegrationOptions::default()
        };
        let shader = Shader::new(light, &scene.tracer, None, options);
        let direct: Vec<Vec3> =
            shader.shade(&points, FIRST_ITEM).iter().map(|s| s.total()).collect();
        let albedo =
            |i: usize| Vec3::from(surface.base_color_linear[i]).clamp(Vec3::ZERO, Vec3::ONE);
        let reflect = |light: &[Vec3]| -> Vec<Vec3> {
            light.iter().enumerate().map(|(i, e)| *e * albedo(i)).collect()
        };
        let mut cache = Self { outgoing: reflect(&direct) };
        let darkness = Environment::default();
        for pass in 1..u64::from(bounces) {
            let l_hit = |_: &Ray, hit: &Hit| cache.at(scene, hit);
            let options = IntegrationOptions {
                light_samples: 0,
                brdf_samples: samples.div_ceil(2),
                ..options
            };
            let shader = Shader::new(&darkness, &scene.tracer, Some(&l_hit), options);
            let gathered = shader.shade(&points, (pass + 1) * FIRST_ITEM);
            let sum: Vec<Vec3> =
                direct.par_iter().zip(&gathered).map(|(d, g)| *d + g.indirect).collect();
            cache = Self { outgoing: reflect(&sum) };
        }
        cache
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.outgoing.is_empty()
    }

    /// What the surface sends from where a ray met it.
    #[inline]
    pub(crate) fn at(&self, scene: &RelightScene, hit: &Hit) -> Vec3 {
        let [a, b, c] =
            scene.surface.triangles[hit.primitive as usize].map(|v| self.outgoing[v as usize]);
        let [u, v] = hit.barycentrics;
        a * (1.0 - u - v) + b * u + c * v
    }
}
