//! Path tracing: every bounce asks the light directly, and a path goes on by the BRDF (Kajiya
//! 1986), the two weighed by the balance heuristic (Veach & Guibas 1995).

use glam::Vec3;
use motes_shading::brdf::Brdf;
use motes_shading::environment::Environment;
use motes_shading::integrate::{LightPool, SurfacePoint};
use motes_shading::sampling::{PointSet, unit_f32};
use motes_shading::tracing::{Ray, offset_origin};

use crate::lamps::{Lamp, SHORT};
use crate::world::World;

/// Directions from the light at the first surface; one at each later one.
const FIRST_LIGHT_SAMPLES: u32 = 4;
const LOG2_POOL: u32 = 18;

/// A light and what integrates it.
pub struct PathTracer<'a> {
    world: &'a World,
    light: &'a Environment,
    /// Lamps that are lit: all of the world, or none.
    lamps: &'a [Lamp],
    pool: LightPool,
    /// Surfaces that a path may meet; light after the last is left out.
    surfaces: u32,
    seed: u64,
}

impl<'a> PathTracer<'a> {
    /// For paths over `1 + bounces` surfaces.
    pub fn new(world: &'a World, light: &'a Environment, bounces: u32, seed: u64) -> Self {
        let pool = LightPool::new(light, LOG2_POOL, seed);
        Self { world, light, lamps: &[], pool, surfaces: bounces + 1, seed }
    }

    /// With the lamps of the world lit, too.
    pub fn with_lamps(self) -> Self {
        Self { lamps: self.world.lamps(), ..self }
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
            // Of later surfaces every lamp was asked already.
            if let (0, Some(lamp)) = (depth, seen.lamp.and_then(|k| self.lamps.get(k as usize))) {
                return throughput * lamp.radiance;
            }
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
            for (lamp, k) in self.lamps.iter().zip(0u32..) {
                let points = PointSet::new(self.seed, item, purpose + 3 + k, samples * n);
                for i in 0..n {
                    let u = points.point(sample * n + i).map(unit_f32);
                    let sent = self.sent_by(lamp, [u[0], u[1]], point, &brdf);
                    sum += throughput * sent / n as f32;
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

    /// What a point of a lamp sends over a surface to its viewer, over the density of that point.
    fn sent_by(&self, lamp: &Lamp, u: [f32; 2], point: &SurfacePoint, brdf: &Brdf) -> Vec3 {
        let at = lamp.point(u);
        let way = at.position - point.position;
        let distance = way.length();
        let to_light = way / distance;
        let (n, cosine) = (point.geometric_normal, -at.normal.dot(to_light));
        if !(cosine > 0.0 && n.dot(to_light) > 0.0) {
            return Vec3::ZERO;
        }
        let origin = offset_origin(point.position, n, to_light, 0.0);
        let ray = Ray { t_max: (1.0 - SHORT) * distance, ..Ray::new(origin, to_light) };
        if self.world.occluded(&ray) {
            return Vec3::ZERO;
        }
        // `f` holds the cosine at the surface.
        let (f, _) = brdf.eval_pdf(to_light);
        f.total() * lamp.radiance * (cosine * at.area / (distance * distance))
    }
}
