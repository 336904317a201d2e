//! What a view sees, before any light: material from the Gaussians, position and normal from the
//! surface.

use glam::{DMat3, DVec3, Vec3};
use motes_math::srgb;
use motes_raster::{Painter, RasterParameters, RenderOptions, Rendering};
use motes_scene::{Gaussians, Pinhole, Pose};
use motes_shading::brdf::Material;
use motes_shading::integrate::SurfacePoint;
use motes_shading::tracing::Ray;
use rayon::prelude::*;

use crate::coverage::coverage;
use crate::first_triangles::{NOTHING, first_triangles};
use crate::ratio::Ratio;
use crate::residual::SceneResidual;
use crate::scene::{RelightScene, SurfaceHit};
use crate::sky::{Land, covered};
use crate::stand_in::StandIn;

/// Below this alpha there is nothing to shade.
pub(crate) const LEAST_ALPHA: f32 = 1.0 / 255.0;
/// Least cosine between normal and viewer: interpolated normals turn away at silhouettes.
const LEAST_COSINE: f32 = 0.03;
/// Neighbors whose normals differ more (cosine) or that lie farther off each other's tangent plane
/// (share of the depth) are an edge.
const EDGE_COSINE: f32 = 0.95;
const EDGE_OFFSET: f32 = 0.004;

/// A point that a ray of the camera meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) position: Vec3,
    /// Unit, within a right angle of the viewer.
    pub(crate) normal: Vec3,
    pub(crate) to_viewer: Vec3,
    /// z in the camera.
    pub(crate) depth: f32,
    /// From the surface, not from the Gaussians.
    pub(crate) on_surface: bool,
    /// Right behind a layer of the surface that is not there, and so in its shadow.
    pub(crate) in_false_shadow: bool,
    /// What the surface sends out there on its own where its lamps shine.
    pub(crate) emitted: Vec3,
}

/// Buffers of a view, row by row.
#[derive(Debug)]
pub(crate) struct GBuffer {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Share of the pixel that is not background.
    pub(crate) coverage: Vec<f32>,
    pub(crate) material: Vec<Material>,
    /// Share of the material that no training view saw.
    pub(crate) unobserved: Vec<f32>,
    /// Through the pixel's center.
    pub(crate) sight: Vec<Option<Sight>>,
    /// Colors that stand for the residual, over black.
    pub(crate) residual: Option<Rendering>,
    /// What stands in for the model, over black.
    pub(crate) ratio: Option<DrawnRatio>,
    /// Colors that stand for the local light.
    pub(crate) local_light: Option<Rendering>,
    /// Pixels of an edge with up to four sights instead of one, sorted by pixel.
    pub(crate) edges: Vec<(u32, [Option<Sight>; 4])>,
}

/// Further colors of the Gaussians that a view is drawn in.
pub(crate) struct Layers<'a> {
    /// What is not sky; none where all is shown.
    pub(crate) land: Option<&'a Land>,
    /// Colors that stand for the residual.
    pub(crate) residual: Option<&'a SceneResidual>,
    /// The captured colors and what they are multiplied with.
    pub(crate) ratio: Option<&'a Ratio>,
    /// Gaussians whose colors stand for the local light.
    pub(crate) local_light: Option<&'a Gaussians>,
}

/// A [`Ratio`] as a view shows it.
#[derive(Debug)]
pub(crate) struct DrawnRatio {
    /// The Gaussians as they were captured.
    pub(crate) captured: Rendering,
    /// Colors that stand for the log ratio.
    pub(crate) log_ratio: Rendering,
    /// Share of the model, in all channels.
    pub(crate) model_share: Rendering,
}

impl DrawnRatio {
    fn of(ratio: &Ratio, captured: &Gaussians, painter: &mut Painter) -> Self {
        Self {
            captured: painter.paint_as(&ratio.captured(captured)),
            log_ratio: painter.paint_as(&ratio.splats),
            model_share: painter.paint(|i| [ratio.model_share[i]; 3]),
        }
    }
}

/// A pinhole camera as rays.
pub(crate) struct Rays {
    eye: Vec3,
    world_from_camera: DMat3,
    camera: Pinhole,
}

impl Rays {
    pub(crate) fn new(camera: &Pinhole, camera_from_world: &Pose) -> Self {
        let inverse = camera_from_world.inverse();
        let (eye, world_from_camera) = (inverse.translation.as_vec3(), inverse.rotation_matrix());
        Self { eye, world_from_camera, camera: *camera }
    }

    /// The ray through a point of the picture, and the cosine to the optical axis.
    #[inline]
    pub(crate) fn through(&self, x: f64, y: f64) -> (Ray, f32) {
        let c = &self.camera;
        let local = DVec3::new((x - c.cx) / c.fx, (y - c.cy) / c.fy, 1.0);
        let cosine = local.length_recip();
        let direction = (self.world_from_camera * local * cosine).as_vec3().normalize();
        (Ray::new(self.eye, direction), cosine as f32)
    }
}

impl Sight {
    pub(crate) fn of(scene: &RelightScene, ray: &Ray, cosine: f32, hit: &SurfaceHit) -> Self {
        let to_viewer = -ray.direction;
        let normal = toward(hit.normal, to_viewer);
        let depth = hit.distance * cosine;
        let emitted = scene.emitted(&hit.hit);
        let (on_surface, in_false_shadow) = (true, false);
        let position = hit.position;
        Self { position, normal, to_viewer, depth, on_surface, in_false_shadow, emitted }
    }
}

/// The normal, bent where it turns away from the viewer.
pub(crate) fn toward(normal: Vec3, to_viewer: Vec3) -> Vec3 {
    let cosine = normal.dot(to_viewer);
    if cosine >= LEAST_COSINE {
        return normal;
    }
    (normal + to_viewer * (LEAST_COSINE - cosine)).normalize_or(to_viewer)
}

/// What the ray through the middle of every pixel meets, row by row.
fn sights(shown: &StandIn<'_>, first: &[u32], width: usize) -> Vec<Option<Sight>> {
    let of_pixel = |(i, triangle): (usize, &u32)| {
        let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        (*triangle != NOTHING).then(|| shown.surface(Some(*triangle), x, y)).flatten()
    };
    first.par_iter().enumerate().with_min_len(1024).map(of_pixel).collect()
}

impl GBuffer {
    /// Of a view. When `detailed`, pixels where the surface has an edge get four sights. The layers are drawn, too.
    pub(crate) fn new(
        scene: &RelightScene,
        camera: &Pinhole,
        camera_from_world: &Pose,
        detailed: bool,
        layers: &Layers<'_>,
    ) -> Self {
        let base_color_splats =
            layers.land.map_or(&scene.base_color_splats, |land| &land.base_color_splats);
        let exact = RasterParameters::default();
        let quick = RasterParameters { alpha_min: 0.01, transmittance_min: 0.01, ..exact };
        let parameters = if detailed { exact } else { quick };
        let antialias = scene.antialias;
        let options = RenderOptions { antialias, parameters, ..RenderOptions::default() };
        let (mut painter_of_colors, color) =
            Painter::new(base_color_splats, camera, camera_from_world, &options);
        let residual = layers.residual.map(|of_scene| painter_of_colors.paint_as(&of_scene.splats));
        let local_light = layers.local_light.map(|splats| painter_of_colors.paint_as(splats));
        let captured = layers.land.map_or(&scene.gaussians, |land| &land.captured);
        let ratio =
            layers.ratio.map(|ratio| DrawnRatio::of(ratio, captured, &mut painter_of_colors));
        let land = layers.land.map(|land| painter_of_colors.paint(|i| [land.share[i]; 3]).color);
        let land: Option<Vec<f32>> =
            land.map(|image| image.data.chunks_exact(3).map(|pixel| pixel[0]).collect());
        let properties = painter_of_colors.paint(|i| scene.properties(i));
        let (width, height) = (camera.width, camera.height);
        let all = &color.alpha.data;
        let alpha = land.as_ref().unwrap_or(all);
        let material = |i: usize| {
            // Blended over black: dividing by alpha leaves the mean of what was blended.
            let share = 1.0 / alpha[i].max(LEAST_ALPHA);
            let base =
                (Vec3::from_slice(&color.color.data[3 * i..3 * i + 3]) * share).map(srgb::decode);
            // Not only what is land.
            let share = 1.0 / all[i].max(LEAST_ALPHA);
            let [r, m, u] = [0, 1, 2].map(|c| properties.color.data[3 * i + c] * share);
            (scene.material(base, r, m), u.clamp(0.0, 1.0))
        };
        let (material, unobserved) = (0..width * height).into_par_iter().map(material).unzip();
        let rays = Rays::new(camera, camera_from_world);
        let first = first_triangles(&scene.surface, camera, camera_from_world);
        let mut stand_in = StandIn::new(scene, &rays, painter_of_colors, camera_from_world);
        let mut sight = sights(&stand_in, &first, width);
        let visible = |i: usize| alpha[i] >= LEAST_ALPHA;
        let missed: Vec<usize> =
            (0..sight.len()).filter(|i| sight[*i].is_none() && visible(*i)).collect();
        if !missed.is_empty() {
            let normals = stand_in.normals();
            for &i in &missed {
                sight[i] = stand_in.sight(&normals, i % width, i / width);
            }
        }
        sight.iter_mut().zip(alpha).filter(|(_, a)| **a < LEAST_ALPHA).for_each(|(s, _)| *s = None);
        let coverage = covered(coverage(all, width, height, scene.fills_photos), alpha, all);
        let mut buffer = Self {
            width,
            height,
            coverage,
            material,
            unobserved,
            sight,
            residual,
            local_light,
            ratio,
            edges: Vec::new(),
        };
        if detailed {
            buffer.edges = buffer.find_edges(&stand_in);
        }
        buffer
    }

    /// Share of the model in what is shown of a pixel, 0 to 1; where no surface was met, or in the shadow of one that is not there, the
    /// model stands on nothing.
    pub(crate) fn model_share(&self, pixel: usize) -> f32 {
        let Some(drawn) = &self.ratio else { return 1.0 };
        let alpha = drawn.captured.alpha.data[pixel].max(LEAST_ALPHA);
        let stands = self.sight[pixel].is_some_and(|s| s.on_surface && !s.in_false_shadow);
        let share = drawn.model_share.color.data[3 * pixel] / alpha;
        if stands { share.clamp(0.0, 1.0) } else { 0.0 }
    }

    fn find_edges(&self, shown: &StandIn<'_>) -> Vec<(u32, [Option<Sight>; 4])> {
        const QUARTERS: [[f64; 2]; 4] = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];
        (0..self.sight.len())
            .into_par_iter()
            .filter(|i| self.sight[*i].is_some() && self.is_edge(*i))
            .map(|i| {
                let (x, y) = ((i % self.width) as f64, (i / self.width) as f64);
                (i as u32, QUARTERS.map(|[dx, dy]| shown.surface(None, x + dx, y + dy)))
            })
            .filter(|(_, sights)| sights.iter().any(Option::is_some))
            .collect()
    }

    fn is_edge(&self, i: usize) -> bool {
        let (x, y) = (i % self.width, i / self.width);
        let Some(own) = &self.sight[i] else { return false };
        let neighbors = [
            (x > 0).then(|| i - 1),
            (x + 1 < self.width).then(|| i + 1),
            (y > 0).then(|| i - self.width),
            (y + 1 < self.height).then(|| i + self.width),
        ];
        neighbors.into_iter().flatten().any(|k| match &self.sight[k] {
            None => true,
            Some(other) => !continues(own, other, EDGE_COSINE, EDGE_OFFSET),
        })
    }

    /// The point of a sight in this pixel.
    pub(crate) fn point(&self, pixel: usize, sight: &Sight) -> SurfacePoint {
        SurfacePoint {
            position: sight.position,
            geometric_normal: sight.normal,
            shading_normal: sight.normal,
            to_viewer: sight.to_viewer,
            material: self.material[pixel],
        }
    }
}

/// Whether two sights belong to one smooth piece of surface.
pub(crate) fn continues(a: &Sight, b: &Sight, cosine: f32, offset: f32) -> bool {
    let apart = (b.position - a.position).dot(a.normal).abs();
    a.normal.dot(b.normal) >= cosine && apart <= offset * a.depth
}
