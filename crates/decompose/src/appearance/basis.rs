//! What a point would send to each camera, as a linear function of its base color.
//!
//! With light, visibility and roughness fixed, a dielectric sends `b D + S` and a metal (nearly) `b A + B`
//! per channel, `b` its base color. So base color is found in closed form for every roughness.

use glam::Vec3;
use motes_shading::brdf::{Brdf, Lobes, Material};
use motes_shading::emitters::Emitters;
use motes_shading::environment::Environment;
use motes_shading::integrate::{IndirectRadiance, IntegrationOptions, Shader, SurfacePoint};
use motes_shading::tracing::{Hit, MeshTracer, Ray, Tracer};
use rayon::prelude::*;

use crate::observation::{Sample, TracedSurface};

/// The terms for one direction of view.
#[derive(Clone, Copy, Debug, Default)]
pub struct Terms {
    /// `D`: diffuse radiance per base color.
    pub diffuse: Vec3,
    /// `S`: specular radiance of a dielectric.
    pub specular: Vec3,
    /// `A`: radiance of a metal per base color.
    pub metal_slope: Vec3,
    /// `B`: radiance of a black metal.
    pub metal_offset: Vec3,
}

/// `[N, R]` terms: `N` observations of all samples in order, `R` values of roughness.
#[derive(Clone, Debug)]
pub struct Basis {
    /// The values of roughness.
    pub roughness: Vec<f32>,
    /// Row-major.
    pub terms: Vec<Terms>,
    /// First row of every sample, and the end.
    pub first: Vec<usize>,
}

impl Basis {
    /// Terms of observation `k` of sample `p` for roughness `r`.
    #[inline]
    pub fn at(&self, p: usize, k: usize, r: usize) -> &Terms {
        &self.terms[(self.first[p] + k) * self.roughness.len() + r]
    }
}

/// Light, geometry and lobes under which terms are integrated.
pub struct BasisScene<'a> {
    /// Geometry.
    pub scene: &'a TracedSurface,
    /// Light from infinity, per capture.
    pub lights: &'a [Environment],
    /// What blocked rays bring back, per capture and vertex, photo units; empty for nothing.
    pub vertex_radiance: &'a [Vec<Vec3>],
    /// Lamps of the surface, which send more than the photos show.
    pub emitters: Option<&'a Emitters>,
    /// Lobes of every material.
    pub lobes: Lobes,
    /// Samples and seed.
    pub options: IntegrationOptions,
}

impl BasisScene<'_> {
    /// Integrates the terms of all observations.
    pub fn integrate(&self, samples: &[Sample], roughness: &[f32]) -> Basis {
        let mut first = vec![0];
        for sample in samples {
            first.push(first[first.len() - 1] + sample.observations.len());
        }
        let terms = self.with_shaders(|shaders| {
            samples
                .par_iter()
                .enumerate()
                .flat_map_iter(|(p, sample)| {
                    let mut out = Vec::with_capacity(sample.observations.len() * roughness.len());
                    for observation in &sample.observations {
                        for &r in roughness {
                            let point = surface_point(sample, observation.to_viewer, r, self.lobes);
                            // One item per point: the noise of its views and lobes is common, so that it does
                            // not look like a highlight.
                            out.push(terms(&shaders[observation.light as usize], &point, p as u64));
                        }
                    }
                    out
                })
                .collect()
        });
        Basis { roughness: roughness.to_vec(), terms, first }
    }

    /// Calls `run` with one shader per light.
    pub fn with_shaders<T>(&self, run: impl FnOnce(&[Shader<'_, MeshTracer>]) -> T) -> T {
        let bounces: Vec<_> = self
            .vertex_radiance
            .iter()
            .map(|radiance| {
                move |_: &Ray, hit: &Hit| {
                    if self.emitters.is_some_and(|lamps| lamps.shines(hit.primitive)) {
                        return Vec3::ZERO;
                    }
                    self.scene.interpolate(hit.primitive, hit.barycentrics, radiance)
                }
            })
            .collect();
        let shaders: Vec<_> = self
            .lights
            .iter()
            .enumerate()
            .map(|(k, light)| {
                let bounce = bounces.get(k).map(|b| b as IndirectRadiance<'_>);
                Shader::new(light, &self.scene.tracer, bounce, self.options)
                    .with_emitters(self.emitters)
            })
            .collect();
        run(&shaders)
    }
}

fn surface_point(sample: &Sample, to_viewer: Vec3, roughness: f32, lobes: Lobes) -> SurfacePoint {
    let material = Material { lobes, ..Material::principled(Vec3::splat(0.5), roughness, 0.0) };
    SurfacePoint {
        position: sample.position,
        geometric_normal: sample.geometric_normal,
        shading_normal: sample.normal,
        to_viewer,
        material,
    }
}

/// The terms at one point: its directions of light, weighed with four materials.
pub(crate) fn terms<T: Tracer>(shader: &Shader<'_, T>, point: &SurfacePoint, item: u64) -> Terms {
    let brdf = |base: f32, metallic: f32| {
        let material =
            Material { base_color_linear: Vec3::splat(base), metallic, ..point.material };
        Brdf::new(&material, point.shading_normal, point.to_viewer)
    };
    let (white, mirror, black) = (brdf(1.0, 0.0), brdf(1.0, 1.0), brdf(0.0, 1.0));
    let mut out = Terms::default();
    for incident in shader.incident_light(point, item) {
        let l = incident.weighted_radiance;
        if l == Vec3::ZERO {
            continue;
        }
        let f = white.eval_pdf(incident.to_light).0;
        out.diffuse += f.diffuse * l;
        out.specular += f.specular * l;
        let (one, zero) = (
            mirror.eval_pdf(incident.to_light).0.specular,
            black.eval_pdf(incident.to_light).0.specular,
        );
        out.metal_slope += (one - zero) * l;
        out.metal_offset += zero * l;
    }
    out
}
