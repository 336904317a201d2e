//! The oracle: independent random numbers, f64, one loop per equation of the parent module.

use glam::DVec3;
use motes_math::luminance::luminance_f64;
use motes_math::rng::keyed_rng;
use rand::RngExt;

use super::{IndirectRadiance, IntegrationOptions, SurfacePoint};
use crate::brdf::reference::Material;
use crate::emitters::Emitters;
use crate::environment::{Environment, reference as light_reference};
use crate::tracing::{Ray, Tracer, offset_origin};

/// Keeps these random streams apart from others of the same seed.
const STREAM: u64 = 0x5ade;

/// An estimate of outgoing radiance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Estimate {
    /// Direct light by the diffuse lobe.
    pub diffuse: DVec3,
    /// Direct light by the specular lobe.
    pub specular: DVec3,
    /// Light that came over one more surface.
    pub indirect: DVec3,
    /// Share of the direct light that is not blocked, 0 to 1; 1 where there is none.
    pub visibility: f64,
    /// Variance of [`Self::total`] per channel, estimated from the samples.
    pub variance: DVec3,
}

impl Estimate {
    /// All light.
    pub fn total(&self) -> DVec3 {
        self.diffuse + self.specular + self.indirect
    }
}

/// Mean and variance of the mean of independent samples.
#[derive(Default)]
struct Moments {
    count: f64,
    sum: DVec3,
    squares: DVec3,
}

impl Moments {
    fn add(&mut self, sample: DVec3) {
        self.count += 1.0;
        self.sum += sample;
        self.squares += sample * sample;
    }

    /// Variance of the sum.
    fn variance(&self) -> DVec3 {
        if self.count < 2.0 {
            return DVec3::ZERO;
        }
        let spread = self.squares - self.sum * self.sum / self.count;
        spread.max(DVec3::ZERO) * self.count / (self.count - 1.0)
    }
}

/// Outgoing radiance at `point`, with the random numbers of `item`.
///
/// A point whose shading normal faces away from the viewer sends nothing.
pub fn outgoing_radiance(
    point: &SurfacePoint,
    light: &Environment,
    tracer: &dyn Tracer,
    indirect: Option<IndirectRadiance>,
    options: &IntegrationOptions,
    item: u64,
) -> Estimate {
    let normal = point.shading_normal.as_dvec3().normalize();
    let geometric = point.geometric_normal.as_dvec3();
    let to_viewer = point.to_viewer.as_dvec3().normalize();
    let material = Material::from(point.material);
    let (n_l, n_b) = (f64::from(options.light_samples), f64::from(options.brdf_samples));
    let mut rng = keyed_rng(options.seed, STREAM, item);
    let ray_toward = |w: DVec3| {
        let w = w.as_vec3().normalize();
        let origin = offset_origin(point.position, point.geometric_normal, w, options.ray_bias);
        Ray::new(origin, w)
    };
    let mut out = Estimate::default();
    let mut unblocked = DVec3::ZERO;
    let (mut by_light, mut by_brdf) = (Moments::default(), Moments::default());

    for _ in 0..options.light_samples {
        let mut contribution = DVec3::ZERO;
        if let Some(sample) = light_reference::sample(light, rng.random()) {
            let w = sample.to_light;
            let f = material.eval(normal, w, to_viewer);
            let p_b = material.pdf(normal, w, to_viewer);
            let scale = options.heuristic.scale(n_l * sample.pdf, n_b * p_b);
            let weight = sample.radiance * (normal.dot(w).max(0.0) * scale);
            unblocked += f.total() * weight;
            let lit = f.total() != DVec3::ZERO
                && geometric.dot(w) > 0.0
                && !tracer.occluded(&ray_toward(w));
            if lit {
                out.diffuse += f.diffuse * weight;
                out.specular += f.specular * weight;
                contribution = f.total() * weight;
            }
        }
        by_light.add(contribution);
    }

    for _ in 0..options.brdf_samples {
        let mut contribution = DVec3::ZERO;
        if let Some(w) = material.sample(normal, to_viewer, rng.random()) {
            let f = material.eval(normal, w, to_viewer);
            let p_b = material.pdf(normal, w, to_viewer);
            let (radiance, p_l) = light_reference::radiance_pdf(light, w);
            let cos = normal.dot(w).max(0.0);
            let scale = options.heuristic.scale(n_b * p_b, n_l * p_l);
            let weight = radiance * (cos * scale);
            unblocked += f.total() * weight;
            if geometric.dot(w) > 0.0 {
                let ray = ray_toward(w);
                if let Some(hit) = tracer.closest_hit(&ray) {
                    if let Some(l_hit) = indirect {
                        let l_hit = l_hit(&ray, &hit).as_dvec3();
                        contribution = f.total() * l_hit * (cos / (n_b * p_b));
                        out.indirect += contribution;
                    }
                } else {
                    out.diffuse += f.diffuse * weight;
                    out.specular += f.specular * weight;
                    contribution = f.total() * weight;
                }
            }
        }
        by_brdf.add(contribution);
    }

    let reachable = luminance_f64(unblocked);
    let direct = luminance_f64(out.diffuse + out.specular);
    out.visibility = if reachable > 0.0 { direct / reachable } else { 1.0 };
    out.variance = by_light.variance() + by_brdf.variance();
    out
}

/// Radiance that `point` sends on of what [`Emitters`] of the traced mesh send to it, with the random numbers of `item`; the
/// rest is that of [`outgoing_radiance`].
pub fn emitted_radiance(
    point: &SurfacePoint,
    emitters: &Emitters,
    tracer: &dyn Tracer,
    options: &IntegrationOptions,
    item: u64,
) -> Estimate {
    let normal = point.shading_normal.as_dvec3().normalize();
    let geometric = point.geometric_normal.as_dvec3();
    let to_viewer = point.to_viewer.as_dvec3().normalize();
    let material = Material::from(point.material);
    let (n_e, n_b) = (f64::from(options.emitter_samples), f64::from(options.brdf_samples));
    let mut rng = keyed_rng(options.seed, STREAM + 1, item);
    let ray_toward = |w: DVec3| {
        let w = w.as_vec3().normalize();
        let origin = offset_origin(point.position, point.geometric_normal, w, options.ray_bias);
        Ray::new(origin, w)
    };
    let mut out = Estimate { visibility: 1.0, ..Estimate::default() };
    let (mut by_area, mut by_brdf) = (Moments::default(), Moments::default());

    for _ in 0..options.emitter_samples {
        let mut contribution = DVec3::ZERO;
        if let Some(sample) = emitters.sample(point.position, rng.random()) {
            let w = sample.to_light.as_dvec3().normalize();
            let f = material.eval(normal, w, to_viewer);
            let p_b = material.pdf(normal, w, to_viewer);
            let shadow =
                sample.shadow_ray(point.position, point.geometric_normal, options.ray_bias);
            if f.total() != DVec3::ZERO && geometric.dot(w) > 0.0 && !tracer.occluded(&shadow) {
                let scale = options.heuristic.scale(n_e * f64::from(sample.pdf), n_b * p_b);
                let weight = sample.radiance.as_dvec3() * (normal.dot(w).max(0.0) * scale);
                out.diffuse += f.diffuse * weight;
                out.specular += f.specular * weight;
                contribution = f.total() * weight;
            }
        }
        by_area.add(contribution);
    }

    for _ in 0..options.brdf_samples {
        let mut contribution = DVec3::ZERO;
        if let Some(w) = material.sample(normal, to_viewer, rng.random())
            && geometric.dot(w) > 0.0
            && let Some(hit) = tracer.closest_hit(&ray_toward(w))
            && let Some((radiance, p_e)) =
                emitters.radiance_pdf(hit.primitive, w.as_vec3().normalize(), hit.distance)
        {
            let f = material.eval(normal, w, to_viewer);
            let p_b = material.pdf(normal, w, to_viewer);
            let scale = options.heuristic.scale(n_b * p_b, n_e * f64::from(p_e));
            let weight = radiance.as_dvec3() * (normal.dot(w).max(0.0) * scale);
            out.diffuse += f.diffuse * weight;
            out.specular += f.specular * weight;
            contribution = f.total() * weight;
        }
        by_brdf.add(contribution);
    }
    out.variance = by_area.variance() + by_brdf.variance();
    out
}
