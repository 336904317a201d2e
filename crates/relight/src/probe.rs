//! Light at single points: what an edit compares before and after.

use glam::Vec3;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};
use motes_shading::tracing::{Hit, MeshTracer, Ray};
use rayon::prelude::*;

use crate::relighter::Relighter;
use crate::scene::RelightScene;
use crate::surface_point::{surface_point, white_matte};

/// Keeps these random numbers apart from those of pixels, vertices and baked colors.
const FIRST_ITEM: u64 = 1 << 52;

/// A point that light is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// World.
    pub position: Vec3,
    /// Unit, world, out of the matter.
    pub normal: Vec3,
    /// Key of its random directions: probes of one item see along the same directions, so that the
    /// difference of two scenes is not hidden by noise.
    pub item: u64,
}

/// What a point of a material sends to viewers.
#[derive(Clone, Debug)]
#[expect(missing_docs, reason = "as everywhere")]
pub struct Question {
    pub probe: Probe,
    pub base_color_linear: Vec3,
    pub roughness: f32,
    pub metallic: f32,
    /// Unit vectors toward at most 256 viewers, world.
    pub to_viewer: Vec<Vec3>,
}

impl RelightScene {
    /// The point of the surface that Gaussian `i` stands for, or its own center and normal.
    pub fn probe(&self, i: usize, item: u64) -> Probe {
        let (position, normal) = surface_point(self, i);
        Probe { position, normal, item }
    }
}

impl Relighter<'_> {
    /// Outgoing radiance of white matte matter at each probe: irradiance over π, direct and once reflected,
    /// linear, photo units. `samples` directions toward the light and a quarter of that over the hemisphere.
    pub fn white_radiance(&self, probes: &[Probe], samples: u32) -> Vec<Vec3> {
        let l_hit = |_: &Ray, hit: &Hit| self.cache.at(self.scene, hit);
        let shader = self.shader(samples, (!self.cache.is_empty()).then_some(&l_hit as _));
        let shade = |probe: &Probe| {
            let point = white_matte(probe.position, probe.normal);
            shader.shade_point(&point, FIRST_ITEM + probe.item).total()
        };
        probes.par_iter().with_min_len(64).map(shade).collect()
    }

    /// Outgoing radiance of each question, one value per direction; `samples` as above.
    pub fn radiance(&self, questions: &[Question], samples: u32) -> Vec<Vec<Vec3>> {
        let l_hit = |_: &Ray, hit: &Hit| self.cache.at(self.scene, hit);
        let shader = self.shader(samples, (!self.cache.is_empty()).then_some(&l_hit as _));
        let answer = |q: &Question| {
            let material = self.scene.material(q.base_color_linear, q.roughness, q.metallic);
            let toward = |(d, to_viewer): (usize, &Vec3)| {
                let point = SurfacePoint {
                    position: q.probe.position,
                    geometric_normal: q.probe.normal,
                    shading_normal: q.probe.normal,
                    to_viewer: *to_viewer,
                    material,
                };
                shader.shade_point(&point, FIRST_ITEM + 256 * q.probe.item + d as u64).total()
            };
            q.to_viewer.iter().enumerate().map(toward).collect()
        };
        questions.par_iter().with_min_len(16).map(answer).collect()
    }

    fn shader<'s>(
        &'s self,
        samples: u32,
        indirect: Option<motes_shading::integrate::IndirectRadiance<'s>>,
    ) -> Shader<'s, MeshTracer> {
        let options = IntegrationOptions {
            light_samples: samples,
            brdf_samples: samples.div_ceil(4),
            ray_bias: self.scene.ray_bias,
            seed: self.seed,
            ..IntegrationOptions::default()
        };
        Shader::new(self.light, &self.scene.tracer, indirect, options).with_emitters(self.lamps)
    }
}
