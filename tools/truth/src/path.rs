//! Path tracing: every bounce asks the light directly, and a path goes on by the BRDF (Kajiya
//! 1986), the two weighed by the balance heuristic (Veach & Guibas 1995).

use glam::Vec3;
use motes_shading::brdf::Brdf;
use motes_shading::environment::Environment;
use motes_shading::integrate::LightPool;
use motes_shading::sampling::{PointSet, unit_f32};
use motes_shading::tracing::{Ray, offset_origin};

use crate::world::World;

/// Directions from the light at the first surface; one at each later one.
const FIRST_LIGHT_SAMPLES: u32 = 4;
const LOG2_POOL: u32 = 18;

/// A light and what integrates it.
pub struct PathTracer<'a> {
    world: &'a World,
    light: &'a Environment,
    pool: LightPool,
    /// Surfaces that a path may meet; light after the last is left out.
    surfaces: u32,
    seed: u64,
}

impl<'a> PathTracer<'a> {
    /// For paths over `1 + bounces` surfaces.
    pub fn new(world: &'a World, light: &'a Environment, bounces: u32, seed: u64) -> Self {
        let pool = LightPool::new(light, LOG2_POOL, seed);
        Self { world, light, pool, surfaces: bounces + 1, seed }
    }

    /// Radiance along `ray`: sample `sample` of `samples` of `item`.
    pub fn radiance(&self, mut ray: Ray, item: u64, sample: u32, samples: u32) -> Vec3 {
        let (mut sum, mut throughput) = (Vec3::ZERO, Vec3::ONE);
        // Density and number of light samples of the last surface; none for the camera.
        let mut last: Option<(f32, f32)> = None;
        for depth in 0..=self.surfaces {
            let Some(seen) = self.world.see(&ray) else {
                let (radiance, p_l) = self.light.radiance_pdf(ray.direction);
                let weight = last.map_or(1.0, |(p_b, n)| p_b / (p_b + n * p_l));
                return sum + throughput * radiance * weight;
            };
            if depth == self.surfaces {
                return sum;
            }
            let point = &seen.point;
            let brdf = Brdf::new(&point.material, point.shading_normal, point.to_viewer);
            if brdf.faces_away() {
                return sum;
            }
            let leave = |w: Vec3| {
                let n = point.geometric_normal;
                (n.dot(w) > 0.0).then(|| Ray::new(offset_origin(point.position, n, w, 0.0), w))
            };
            let n = if depth == 0 { FIRST_LIGHT_SAMPLES } else { 1 };
            let purpose = 16 * (depth + 1);
            let key = PointSet::new(self.seed, item, purpose, samples).point(sample)[0];
            for light in self.pool.block(u64::from(key), n).iter().flatten() {
                let (f, p_b) = brdf.eval_pdf(light.to_light);
                let scale = 1.0 / (n as f32 * light.pdf + p_b);
                let open = |ray: Ray| !self.world.occluded(&ray);
                if p_b > 0.0 && leave(light.to_light).is_some_and(open) {
                    sum += throughput * f.total() * light.radiance * scale;
                }
            }
            let u = PointSet::new(self.seed, item, purpose + 1, samples).point(sample);
            let Some(w) = brdf.sample(u.map(unit_f32)) else { return sum };
            let (f, p_b) = brdf.eval_pdf(w);
            let Some(next) = leave(w).filter(|_| p_b > 0.0) else { return sum };
            throughput *= f.total() / p_b;
            // Russian roulette (Arvo & Kirk 1990): dim paths end early, the others carry their light.
            let survives = (1.5 * throughput.max_element()).clamp(0.1, 1.0);
            if unit_f32(PointSet::new(self.seed, item, purpose + 2, samples).point(sample)[0])
                >= survives
            {
                return sum;
            }
            throughput /= survives;
            last = Some((p_b, n as f32));
            ray = next;
        }
        sum
    }
}
