//! A decomposed scene, ready for light.

use std::sync::{Arc, OnceLock};

use glam::Vec3;
use motes_math::srgb;
use motes_math::tone_curve::ToneCurve;
use motes_raster::Antialias;
use motes_scene::{Gaussians, Materials, Surface, confidence_of, local_light_of, sky_of};
use motes_shading::brdf::{Lobes, Material};
use motes_shading::emitters::Emitters;
use motes_shading::environment::{Environment, Harmonics};
use motes_shading::tracing::{
    BuildQuality, Hit, MeshError, MeshTracer, Ray, Tracer as _, TriangleMesh,
};
use thiserror::Error;

use crate::captured_light::CapturedLight;
use crate::disputed::without_disputed;
use crate::log_layer;
use crate::residual::SceneResidual;
use crate::windows::with_windows;

/// Why a scene cannot be lit.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SceneError {
    /// A column is missing or has another type.
    #[error("the Gaussians have no column \"{0}\" of the right type")]
    Column(&'static str),
    /// The columns of the residual do not belong together.
    #[error("the Gaussians have columns \"residual_*\", but none \"{0}\" of the right type")]
    Residual(String),
    /// The surface has no material.
    #[error("the vertices of the surface have no base_color, roughness and metallic")]
    SurfaceMaterial,
    /// The mesh is broken.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Gaussians with material, and the surface that rays meet.
#[derive(Debug)]
pub struct RelightScene {
    /// As captured, with all columns.
    pub gaussians: Gaussians,
    /// The columns.
    pub materials: Materials,
    /// The footprint to draw the Gaussians with.
    pub antialias: Antialias,
    /// Lobes of the materials.
    pub lobes: Lobes,
    /// Whether one bounce is worth it, as the decomposition found.
    pub indirect: bool,
    /// Unit vector away from the ground.
    pub up_in_world: Vec3,
    /// The light of the photos, where it is known: the residual is about it.
    pub own_light: Option<Harmonics>,
    /// The same light whole, where it is known: ratios of light are about it.
    pub own_environment: Option<Environment>,
    /// What the camera did to sRGB-encoded light; the colors of the Gaussians are without it.
    pub tone_curve: ToneCurve,
    /// Whether the photos show the scene in every pixel, so that it is dark where Gaussians cover little.
    pub fills_photos: bool,
    /// How far the decomposition is to be trusted, per Gaussian, 0 to 1, where it says so.
    pub confidence: Option<Vec<f32>>,
    /// Share of every Gaussian that is sky, 0 to 1, where the photos show one or a window.
    pub sky: Option<Vec<f32>>,
    /// Logarithm of the local light at every Gaussian, where the decomposition found one.
    pub(crate) local_log_factor: Option<Vec<Vec3>>,
    /// Colors stand for it.
    pub(crate) local_splats: Option<Gaussians>,
    pub(crate) residual: Option<SceneResidual>,
    pub(crate) surface: Surface,
    pub(crate) tracer: MeshTracer,
    /// Found when it is first asked for: only ratios of light take it.
    undisputed: OnceLock<Option<MeshTracer>>,
    /// The same.
    pub(crate) captured_light: OnceLock<Arc<CapturedLight>>,
    /// Lamps of the surface, as they shine in the photos.
    pub(crate) lamps: Option<Emitters>,
    /// Degree 0; colors are base color, sRGB-encoded, as they are blended.
    pub(crate) base_color_splats: Gaussians,
    /// How far rays start off the surface, world units.
    pub(crate) ray_bias: f32,
    /// Of the surface, world units.
    median_edge: f32,
}

impl RelightScene {
    /// Prepares a scene: the tree of the surface, the columns as colors.
    ///
    /// # Errors
    /// When a material column is missing, the surface has no material, or a triangle refers to a
    /// vertex that does not exist. A surface without triangles is fine: nothing casts a shadow.
    pub fn new(
        gaussians: Gaussians,
        surface: Surface,
        lobes: Lobes,
        indirect: bool,
        up_in_world: Vec3,
    ) -> Result<Self, SceneError> {
        let materials = Materials::of(&gaussians).map_err(SceneError::Column)?;
        if !surface.triangles.is_empty() && !surface.has_materials() {
            return Err(SceneError::SurfaceMaterial);
        }
        let mesh = TriangleMesh::from(&surface);
        // More care with the tree does not pay: rays gain little (docs/benchmarks/shading.md).
        let tracer = MeshTracer::new(&mesh, BuildQuality::Fast)?;
        let median_edge = mesh.median_edge();
        let ray_bias = mesh.roughness();
        let tracer = tracer.one_sided_within(TriangleMesh::LAYERS * ray_bias);
        let base_color_splats =
            gaussians.colored(|i| materials.base_color_linear[i].map(srgb::encode));
        let emission: Vec<Vec3> = surface.emission_linear.iter().map(|&e| e.into()).collect();
        let lamps = Emitters::new(&mesh, &emission);
        let residual = SceneResidual::of(&gaussians).map_err(SceneError::Residual)?;
        let confidence = confidence_of(&gaussians);
        let sky = with_windows(&gaussians, &surface, sky_of(&gaussians));
        let local_log_factor: Option<Vec<Vec3>> =
            local_light_of(&gaussians).map(|all| all.into_iter().map(Vec3::from).collect());
        let local_splats = local_log_factor.as_ref().map(|l| log_layer::drawn(l, &gaussians));
        Ok(Self {
            gaussians,
            materials,
            antialias: Antialias::default(),
            lobes,
            indirect,
            up_in_world: up_in_world.normalize_or(Vec3::Z),
            own_light: None,
            own_environment: None,
            tone_curve: ToneCurve::default(),
            fills_photos: false,
            confidence,
            sky,
            local_log_factor,
            local_splats,
            residual,
            surface,
            tracer,
            undisputed: OnceLock::new(),
            captured_light: OnceLock::new(),
            lamps,
            base_color_splats,
            ray_bias,
            median_edge,
        })
    }

    /// The surface without what the photos speak against, where they do.
    pub(crate) fn undisputed(&self) -> Option<&MeshTracer> {
        let found = || {
            let confidence = self.confidence.as_deref()?;
            let mesh = TriangleMesh::from(&self.surface);
            let observations = &self.materials.observations;
            let rest =
                without_disputed(&mesh, &self.gaussians, confidence, observations, &self.surface)?;
            Some(rest.one_sided_within(TriangleMesh::LAYERS * mesh.roughness()))
        };
        self.undisputed.get_or_init(found).as_ref()
    }

    /// What a point of the surface sends out on its own; 0 where it is dark.
    #[inline]
    pub(crate) fn emitted(&self, hit: &Hit) -> Vec3 {
        let Some(lamps) = &self.lamps else { return Vec3::ZERO };
        lamps.radiance(hit.primitive)
    }

    /// With the edge length of another scene, where that has a surface: rays start as far off this one. A scene that something was
    /// put into stays as rough as it was, however fine the mesh of that is.
    #[must_use]
    pub fn as_rough_as(self, other: &Self) -> Self {
        match other.median_edge > 0.0 {
            true => Self { ray_bias: other.ray_bias, median_edge: other.median_edge, ..self },
            false => self,
        }
    }

    /// Roughness and metallic of a Gaussian, and 1 where no view saw it.
    #[inline]
    pub(crate) fn properties(&self, i: usize) -> [f32; 3] {
        let materials = &self.materials;
        let unobserved = if materials.observations[i] == 0 { 1.0 } else { 0.0 };
        [materials.roughness[i], materials.metallic[i], unobserved]
    }

    /// Gaussians whose material is a guess.
    pub fn unobserved(&self) -> usize {
        self.materials.observations.iter().filter(|n| **n == 0).count()
    }

    /// Whether it holds what its model left unexplained.
    pub fn has_residual(&self) -> bool {
        self.residual.is_some()
    }

    /// The surface that rays meet, with its materials.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Triangles of the surface.
    pub fn triangles(&self) -> usize {
        self.surface.triangles.len()
    }

    /// How far rays start off the surface, world units: half its median edge.
    pub fn ray_bias(&self) -> f32 {
        self.ray_bias
    }

    /// Median edge of the surface, world units; 0 without triangles.
    pub(crate) fn median_edge(&self) -> f32 {
        self.median_edge
    }

    /// A material with this scene's lobes, clamped to its ranges.
    pub(crate) fn material(&self, base_color: Vec3, roughness: f32, metallic: f32) -> Material {
        let material = Material::principled(base_color, roughness, metallic);
        Material { lobes: self.lobes, ..material }
    }

    /// The first point of the surface on a ray, with its normals turned toward the ray's start.
    pub(crate) fn first_hit(&self, ray: &Ray) -> Option<SurfaceHit> {
        self.tracer.closest_hit(ray).map(|hit| self.seen(ray, hit))
    }

    /// As [`Self::first_hit`], when it is known which triangle that is.
    pub(crate) fn hit_of(&self, triangle: u32, ray: &Ray) -> Option<SurfaceHit> {
        let [a, b, c] = self.surface.triangles[triangle as usize]
            .map(|v| Vec3::from(self.surface.vertices[v as usize]) - ray.origin);
        let d = ray.direction;
        let plane = (b - a).cross(c - a);
        let distance = a.dot(plane) / plane.dot(d);
        // As rays are tested: see `tracing/packet.rs`.
        let u = (c - a).cross(c + a).dot(d);
        let v = (a - b).cross(a + b).dot(d);
        let w = (b - c).cross(b + c).dot(d);
        let barycentrics = [u, v].map(|weight| weight / (u + v + w));
        let usable = distance > 0.0 && distance.is_finite();
        if !(usable && barycentrics.iter().all(|weight| weight.is_finite())) {
            return self.first_hit(ray);
        }
        let geometric_normal = self.tracer.geometric_normal(triangle);
        let hit = Hit { distance, primitive: triangle, barycentrics, geometric_normal };
        Some(self.seen(ray, hit))
    }

    fn seen(&self, ray: &Ray, hit: Hit) -> SurfaceHit {
        let mut normal = self.interpolated_normal(&hit);
        if hit.geometric_normal.dot(ray.direction) > 0.0 {
            normal = -normal;
        }
        SurfaceHit { position: ray.at(hit.distance), normal, distance: hit.distance, hit }
    }

    fn interpolated_normal(&self, hit: &Hit) -> Vec3 {
        let [a, b, c] = self.surface.triangles[hit.primitive as usize]
            .map(|v| Vec3::from(self.surface.normals[v as usize]));
        let [u, v] = hit.barycentrics;
        let normal = (a * (1.0 - u - v) + b * u + c * v).normalize_or(hit.geometric_normal);
        // Normals that point to the other side of their triangle are noise.
        if normal.dot(hit.geometric_normal) > 0.0 { normal } else { hit.geometric_normal }
    }
}

/// A point of the surface.
pub(crate) struct SurfaceHit {
    pub(crate) position: Vec3,
    /// For shading, unit.
    pub(crate) normal: Vec3,
    pub(crate) distance: f32,
    pub(crate) hit: Hit,
}
