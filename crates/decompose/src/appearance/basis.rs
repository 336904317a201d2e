//! What a point would send to each camera, as a linear function of its base color.
//!
//! With light, visibility and roughness fixed, a dielectric sends `b D + S` and a metal (nearly) `b A + B`
//! per channel, `b` its base color. So base color is found in closed form for every roughness.

use glam::Vec3;
use motes_shading::brdf::{BrdfValue, Lobes, Material, Model, WithModel, with_model};
use motes_shading::emitters::Emitters;
use motes_shading::environment::Environment;
use motes_shading::integrate::{
    Incident, IndirectRadiance, IntegrationOptions, Shader, Shadows, SurfacePoint,
};
use motes_shading::tracing::{Hit, MeshTracer, Ray};
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

impl Terms {
    /// Adds others.
    pub(crate) fn add(&mut self, other: &Self) {
        self.diffuse += other.diffuse;
        self.specular += other.specular;
        self.metal_slope += other.metal_slope;
        self.metal_offset += other.metal_offset;
    }
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
                    // One item per point: the noise of its views and lobes is common, so that it does
                    // not look like a highlight. So are its shadows, which are traced once.
                    let item = p as u64;
                    let mut shadows: Vec<Option<Shadows>> = vec![None; shaders.len()];
                    for observation in &sample.observations {
                        let light = observation.light as usize;
                        for &r in roughness {
                            let point = surface_point(sample, observation.to_viewer, r, self.lobes);
                            let shadows = shadows[light]
                                .get_or_insert_with(|| shaders[light].shadows(&point, item));
                            let light = shaders[light].incident_light_with(&point, item, shadows);
                            out.push(terms(&point, &light));
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

/// Which terms are asked for; the others stay 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    pub dielectric: bool,
    pub metal: bool,
}

impl Wanted {
    pub(crate) const ALL: Self = Self { dielectric: true, metal: true };
}

/// Calls `add` with what every direction of light adds to the terms at a point: three materials weigh it.
pub(crate) fn each_term(
    point: &SurfacePoint,
    incident_light: &[Incident],
    wanted: Wanted,
    add: impl FnMut(Terms),
) {
    with_model(point.material.lobes, EachTerm { point, incident_light, wanted, add });
}

struct EachTerm<'a, F> {
    point: &'a SurfacePoint,
    incident_light: &'a [Incident],
    wanted: Wanted,
    add: F,
}

impl<F: FnMut(Terms)> WithModel for EachTerm<'_, F> {
    type Output = ();

    fn run<M: Model>(mut self) {
        let point = self.point;
        let brdf = |base: f32, metallic: f32| {
            let material =
                Material { base_color_linear: Vec3::splat(base), metallic, ..point.material };
            M::new(&material, point.shading_normal, point.to_viewer)
        };
        let brdfs = [brdf(1.0, 0.0), brdf(1.0, 1.0), brdf(0.0, 1.0)];
        for incident in self.incident_light {
            let (l, w) = (incident.weighted_radiance, incident.to_light);
            if l == Vec3::ZERO {
                continue;
            }
            let [white, mirror, black] = if self.wanted.metal {
                M::eval_alike(&brdfs, w)
            } else {
                [brdfs[0].eval_pdf(w).0, BrdfValue::default(), BrdfValue::default()]
            };
            let mut out = Terms::default();
            if self.wanted.dielectric {
                (out.diffuse, out.specular) = (white.diffuse * l, white.specular * l);
            }
            if self.wanted.metal {
                (out.metal_slope, out.metal_offset) =
                    ((mirror.specular - black.specular) * l, black.specular * l);
            }
            (self.add)(out);
        }
    }
}

/// The sum of [`each_term`].
fn terms(point: &SurfacePoint, incident_light: &[Incident]) -> Terms {
    let mut out = Terms::default();
    each_term(point, incident_light, Wanted::ALL, |term| out.add(&term));
    out
}
