//! The same estimator in f32, with stratified points and samples of the light that all points share.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::{IndirectRadiance, IntegrationOptions, LightPool, SurfacePoint};
use crate::brdf::{BrdfValue, Model, WithModel, with_model};
use crate::emitters::{EmitterSample, Emitters};
use crate::environment::{Environment, LightSample};
use crate::sampling::{PointSet, unit_f32};
use crate::tracing::{Ray, Tracer, offset_origin};

/// Points per task; the result does not depend on it.
const CHUNK: usize = 64;
const BRDF_PURPOSE: u32 = 1;
const BLOCK_PURPOSE: u32 = 2;
const EMITTER_PURPOSE: u32 = 3;
/// Samples in the pool of the light, see [`LightPool`].
const LOG2_POOL: u32 = 16;

/// Outgoing radiance of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shaded {
    /// Direct light by the diffuse lobe.
    pub diffuse: Vec3,
    /// Direct light by the specular lobe.
    pub specular: Vec3,
    /// Light that came over one more surface.
    pub indirect: Vec3,
    /// Share of the direct light that is not blocked, 0 to 1; 1 where there is none.
    pub visibility: f32,
    /// Estimated variance of the sum of all, mean of the channels. Samples are stratified, so the
    /// true variance is smaller.
    pub variance: f32,
}

impl Shaded {
    /// All light.
    pub fn total(&self) -> Vec3 {
        self.diffuse + self.specular + self.indirect
    }
}

/// One direction of a point's incident light: its share of the outgoing radiance is
/// `f_r (n · w_i)⁺ * weighted_radiance`.
///
/// A fit that keeps these fixed and re-evaluates the BRDF compares materials without noise between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// Unit vector toward the light.
    pub to_light: Vec3,
    /// Radiance over the density of all strategies; 0 where blocked and nothing comes back.
    pub weighted_radiance: Vec3,
    /// What it would be if nothing were in the way.
    pub unblocked: Vec3,
    /// Whether the radiance came from a surface.
    pub is_indirect: bool,
    /// Whether the BRDF proposed the direction, not the light.
    pub from_brdf: bool,
}

/// Which directions toward lights are open from a point: the same for every material and side that it is seen from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shadows {
    /// Per sample of the light.
    light: Vec<bool>,
    /// Per sample of the emitters.
    emitters: Vec<bool>,
}

/// Shades points of one scene under one light.
pub struct Shader<'a, T> {
    light: &'a Environment,
    tracer: &'a T,
    indirect: Option<IndirectRadiance<'a>>,
    emitters: Option<&'a Emitters>,
    options: IntegrationOptions,
    pool: Arc<LightPool>,
}

impl<'a, T: Tracer> Shader<'a, T> {
    /// Prepares a light; `indirect` tells what blocked rays bring back (nothing, without it).
    pub fn new(
        light: &'a Environment,
        tracer: &'a T,
        indirect: Option<IndirectRadiance<'a>>,
        options: IntegrationOptions,
    ) -> Self {
        let pool = LightPool::shared(light, LOG2_POOL, options.seed);
        Self { light, tracer, indirect, emitters: None, options, pool }
    }

    /// With triangles of the traced mesh that shine. What `indirect` says of them is then what they reflect.
    pub fn with_emitters(self, emitters: Option<&'a Emitters>) -> Self {
        Self { emitters, ..self }
    }

    /// Shades `points`; point `i` uses the random numbers of item `first_item + i`, so that parts
    /// of a picture agree with the whole.
    pub fn shade(&self, points: &[SurfacePoint], first_item: u64) -> Vec<Shaded> {
        let mut out = vec![Shaded::default(); points.len()];
        out.par_chunks_mut(CHUNK).zip(points.par_chunks(CHUNK)).enumerate().for_each(
            |(chunk, (out, points))| {
                let first = first_item + (chunk * CHUNK) as u64;
                for (i, (shaded, point)) in out.iter_mut().zip(points).enumerate() {
                    *shaded = self.shade_point(point, first + i as u64);
                }
            },
        );
        out
    }

    /// Shades one point.
    pub fn shade_point(&self, point: &SurfacePoint, item: u64) -> Shaded {
        let mut out = Shaded::default();
        let mut unblocked = Vec3::ZERO;
        // Of the light's and of the BRDF's directions: their means differ, so do their spreads.
        let (mut sums, mut squares) = ([Vec3::ZERO; 2], [Vec3::ZERO; 2]);
        self.visit(point, item, |incident, f| {
            let (diffuse, specular) =
                (f.diffuse * incident.weighted_radiance, f.specular * incident.weighted_radiance);
            let total = diffuse + specular;
            sums[usize::from(incident.from_brdf)] += total;
            squares[usize::from(incident.from_brdf)] += total * total;
            unblocked += f.total() * incident.unblocked;
            if incident.is_indirect {
                out.indirect += total;
            } else {
                out.diffuse += diffuse;
                out.specular += specular;
            }
        });
        let direct = (out.diffuse + out.specular).element_sum();
        let reachable = unblocked.element_sum();
        out.visibility = if reachable > 0.0 { (direct / reachable).min(1.0) } else { 1.0 };
        for (k, n) in
            [self.options.light_samples, self.options.brdf_samples].into_iter().enumerate()
        {
            let n = n.max(1) as f32;
            let spread = (squares[k] - sums[k] * sums[k] / n).max(Vec3::ZERO).element_sum() / 3.0;
            out.variance += spread * n / (n - 1.0).max(1.0);
        }
        out
    }

    /// The directions that [`Self::shade_point`] sums over.
    pub fn incident_light(&self, point: &SurfacePoint, item: u64) -> Vec<Incident> {
        let mut all = Vec::new();
        self.visit(point, item, |incident, _| all.push(incident));
        all
    }

    /// The same with shadows that are known: those of this point and item, for another material or viewer.
    pub fn incident_light_with(
        &self,
        point: &SurfacePoint,
        item: u64,
        shadows: &Shadows,
    ) -> Vec<Incident> {
        let mut all = Vec::new();
        let add = |incident, _: &BrdfValue| all.push(incident);
        let visit = Visit { shader: self, point, item, shadows: Some(shadows), add };
        with_model(point.material.lobes, visit);
        all
    }

    /// Traces the shadow rays of a point; its material and viewer do not matter.
    pub fn shadows(&self, point: &SurfacePoint, item: u64) -> Shadows {
        let light = self.light_block(item).map(|sample| self.is_lit(point, sample.to_light));
        let emitters = self.emitters.map_or_else(Vec::new, |emitters| {
            let samples = self.emitter_samples(emitters, point, item);
            samples.map(|sample| self.is_lit_by(point, &sample)).collect()
        });
        Shadows { light: light.collect(), emitters }
    }

    /// The samples of the light that belong to an item.
    fn light_block(&self, item: u64) -> impl Iterator<Item = &LightSample> {
        let key = PointSet::new(self.options.seed, item, BLOCK_PURPOSE, 1).point(0)[0];
        self.pool.block(u64::from(key), self.options.light_samples).iter().flatten()
    }

    fn emitter_samples(
        &self,
        emitters: &Emitters,
        point: &SurfacePoint,
        item: u64,
    ) -> impl Iterator<Item = EmitterSample> {
        let o = &self.options;
        let points = PointSet::new(o.seed, item, EMITTER_PURPOSE, o.emitter_samples);
        let position = point.position;
        (0..o.emitter_samples).filter_map(move |i| emitters.sample(position, points.point(i)))
    }

    fn is_lit(&self, point: &SurfacePoint, w: Vec3) -> bool {
        let (n, bias) = (point.geometric_normal, self.options.ray_bias);
        let ray = || Ray::new(offset_origin(point.position, n, w, bias), w);
        n.dot(w) > 0.0 && !self.tracer.occluded(&ray())
    }

    fn is_lit_by(&self, point: &SurfacePoint, sample: &EmitterSample) -> bool {
        let n = point.geometric_normal;
        let shadow = || sample.shadow_ray(point.position, n, self.options.ray_bias);
        n.dot(sample.to_light) > 0.0 && !self.tracer.occluded(&shadow())
    }

    /// Calls `add` for every direction that carries light or could, with `f_r (n · w_i)⁺` there.
    #[inline]
    fn visit(&self, point: &SurfacePoint, item: u64, add: impl FnMut(Incident, &BrdfValue)) {
        with_model(point.material.lobes, Visit { shader: self, point, item, shadows: None, add });
    }

    /// The loop, compiled for every model.
    #[inline]
    fn visit_with<M: Model>(
        &self,
        point: &SurfacePoint,
        item: u64,
        shadows: Option<&Shadows>,
        mut add: impl FnMut(Incident, &BrdfValue),
    ) {
        let brdf = M::new(&point.material, point.shading_normal, point.to_viewer);
        if brdf.faces_away() {
            return;
        }
        let o = &self.options;
        let (n_l, n_b) = (o.light_samples as f32, o.brdf_samples as f32);
        let leaves = |w: Vec3| point.geometric_normal.dot(w) > 0.0;
        let ray = |w: Vec3| {
            Ray::new(offset_origin(point.position, point.geometric_normal, w, o.ray_bias), w)
        };

        for (k, sample) in self.light_block(item).enumerate() {
            let w = sample.to_light;
            let (f, p_b) = brdf.eval_pdf(w);
            if !(p_b > 0.0) {
                continue;
            }
            let scale = self.scale(n_l * sample.pdf, n_b * p_b);
            let unblocked = sample.radiance * scale;
            let lit = shadows.map_or_else(|| self.is_lit(point, w), |shadows| shadows.light[k]);
            let weighted_radiance = if lit { unblocked } else { Vec3::ZERO };
            let (is_indirect, from_brdf) = (false, false);
            add(Incident { to_light: w, weighted_radiance, unblocked, is_indirect, from_brdf }, &f);
        }

        if let Some(emitters) = self.emitters {
            let brdf_and_shadows = (&brdf, shadows);
            self.visit_emitters(emitters, point, item, brdf_and_shadows, &mut add);
        }

        let points = PointSet::new(o.seed, item, BRDF_PURPOSE, o.brdf_samples);
        for i in 0..o.brdf_samples {
            let Some(w) = brdf.sample(points.point(i).map(unit_f32)) else {
                continue;
            };
            let (f, p_b) = brdf.eval_pdf(w);
            if !(p_b > 0.0) {
                continue;
            }
            let (radiance, p_l) = self.light.radiance_pdf(w);
            let scale = self.scale(n_b * p_b, n_l * p_l);
            let mut incident = Incident {
                to_light: w,
                weighted_radiance: Vec3::ZERO,
                unblocked: radiance * scale,
                is_indirect: false,
                from_brdf: true,
            };
            let emitted =
                if leaves(w) { self.trace(&ray(w), n_b * p_b, &mut incident) } else { None };
            add(incident, &f);
            if let Some(emitted) = emitted {
                add(emitted, &f);
            }
        }
    }

    /// Points on emitters.
    fn visit_emitters<M: Model>(
        &self,
        emitters: &Emitters,
        point: &SurfacePoint,
        item: u64,
        (brdf, shadows): (&M, Option<&Shadows>),
        add: &mut impl FnMut(Incident, &BrdfValue),
    ) {
        let o = &self.options;
        let (n_e, n_b) = (o.emitter_samples as f32, o.brdf_samples as f32);
        for (k, sample) in self.emitter_samples(emitters, point, item).enumerate() {
            let w = sample.to_light;
            let (f, p_b) = brdf.eval_pdf(w);
            if !(p_b > 0.0) {
                continue;
            }
            let unblocked = sample.radiance * self.scale(n_e * sample.pdf, n_b * p_b);
            let lit = shadows
                .map_or_else(|| self.is_lit_by(point, &sample), |shadows| shadows.emitters[k]);
            let weighted_radiance = if lit { unblocked } else { Vec3::ZERO };
            let (is_indirect, from_brdf) = (false, false);
            add(Incident { to_light: w, weighted_radiance, unblocked, is_indirect, from_brdf }, &f);
        }
    }

    #[inline]
    fn scale(&self, this: f32, other: f32) -> f32 {
        self.options.heuristic.scale(f64::from(this), f64::from(other)) as f32
    }

    /// Where a BRDF ray of density `n_b p_b` ends, and what an emitter sends from there.
    #[inline]
    fn trace(&self, ray: &Ray, density: f32, incident: &mut Incident) -> Option<Incident> {
        if self.indirect.is_none() && self.emitters.is_none() {
            // Darkness needs no ray.
            let open = incident.unblocked != Vec3::ZERO && !self.tracer.occluded(ray);
            incident.weighted_radiance = if open { incident.unblocked } else { Vec3::ZERO };
            return None;
        }
        let Some(hit) = self.tracer.closest_hit(ray) else {
            incident.weighted_radiance = incident.unblocked;
            return None;
        };
        if let Some(l_hit) = self.indirect {
            // The light behind stays in `unblocked`: it is what visibility compares with. No other strategy finds this.
            incident.weighted_radiance = l_hit(ray, &hit) / density;
            incident.is_indirect = true;
        }
        let (radiance, p_e) =
            self.emitters?.radiance_pdf(hit.primitive, ray.direction, hit.distance)?;
        let emitted = radiance * self.scale(density, self.options.emitter_samples as f32 * p_e);
        Some(Incident {
            weighted_radiance: emitted,
            unblocked: emitted,
            is_indirect: false,
            ..*incident
        })
    }
}

/// [`Shader::visit`] with a model.
struct Visit<'s, 'a, T, F> {
    shader: &'s Shader<'a, T>,
    point: &'s SurfacePoint,
    item: u64,
    shadows: Option<&'s Shadows>,
    add: F,
}

impl<T: Tracer, F: FnMut(Incident, &BrdfValue)> WithModel for Visit<'_, '_, T, F> {
    type Output = ();

    #[inline]
    fn run<M: Model>(self) {
        self.shader.visit_with::<M>(self.point, self.item, self.shadows, self.add);
    }
}
