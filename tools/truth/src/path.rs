//! Path tracing: every bounce asks the light directly, and a path goes on by the BRDF (Kajiya
//! 1986), the two weighed by the balance heuristic (Veach & Guibas 1995).

use glam::Vec3;
use motes_shading::brdf::Brdf;
use motes_shading::environment::Environment;
use motes_shading::integrate::{LightPool, SurfacePoint};
use motes_shading::sampling::{PointSet, unit_f32};
use motes_shading::tracing::{Ray, offset_origin};

use crate::glass::{MOST_PANES, pane_reflectance};
use crate::lamps::{Lamp, SHORT};
use crate::world::{Seen, World};

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
            let numbers = |number| {
                let key = PointSet::new(self.seed, item, 16 * (depth + 1) + 8 + number, samples);
                unit_f32(key.point(sample)[0])
            };
            let met = self.past_glass(&mut ray, &mut throughput, &mut last, numbers);
            let Some(seen) = met else {
                let (radiance, p_l) = self.light.radiance_pdf(ray.direction);
                let weight = last.map_or(1.0, |(p_b, n)| p_b / (p_b + n * p_l));
                return sum + throughput * radiance * weight;
            };
            // Of later surfaces every lamp was asked already, but not through what mirrors.
            let lamp = seen.lamp.and_then(|k| self.lamps.get(k as usize));
            if let (None, Some(lamp)) = (last, lamp) {
                return sum + throughput * lamp.radiance;
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
                if let Some(ray) = leave(light.to_light).filter(|_| p_b > 0.0) {
                    let arrives = self.world.transmittance(&ray);
                    sum += throughput * arrives * f.total() * light.radiance * scale;
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

    /// What a path meets beyond the glass in its way, each pane of which it passes or leaves by reflection, by one of `numbers`.
    fn past_glass(
        &self,
        ray: &mut Ray,
        throughput: &mut Vec3,
        last: &mut Option<(f32, f32)>,
        numbers: impl Fn(u32) -> f32,
    ) -> Option<Seen> {
        for pane in 0..MOST_PANES {
            let seen = self.world.see(ray)?;
            if !seen.is_glass {
                return Some(seen);
            }
            let point = &seen.point;
            let (n, to_viewer) = (point.shading_normal, point.to_viewer);
            let cosine = n.dot(to_viewer);
            let direction = if numbers(pane) < pane_reflectance(cosine) {
                *last = None;
                2.0 * cosine * n - to_viewer
            } else {
                // The surface before it asked the light through this pane: its weight stays.
                *throughput *= point.material.base_color_linear;
                ray.direction
            };
            *ray = seen.behind(direction);
        }
        self.world.see(ray)
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
        let arrives = self.world.transmittance(&ray);
        if arrives == Vec3::ZERO {
            return Vec3::ZERO;
        }
        // `f` holds the cosine at the surface.
        let (f, _) = brdf.eval_pdf(to_light);
        arrives * f.total() * lamp.radiance * (cosine * at.area / (distance * distance))
    }
}
