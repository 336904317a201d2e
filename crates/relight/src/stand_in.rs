//! Depth and normal as the Gaussians show them, beside the surface.
//!
//! Where the surface was missed they stand in for it. Where rays meet more than one layer of it, they tell which one the picture
//! shows: fusion leaves a rim around thin and far things that is some voxels wide, and what lies behind that rim would
//! be lit as if it lay there.

use glam::Vec3;
use motes_raster::{Painter, Rendering};
use motes_scene::Pose;
use motes_shading::tracing::{Ray, TriangleMesh};
use rayon::prelude::*;

use crate::g_buffer::{LEAST_ALPHA, Rays, Sight, toward};
use crate::scene::RelightScene;

/// Gaussians that cover less of a pixel say nothing about the layer that it shows.
const COVERED: f32 = 0.5;
/// Nor do those that are less sure as a mean: where a splat is wrong about the depth, surface and photos contradict it.
const SURE: f32 = 0.35;
/// A layer is shown when the reciprocal depth of the Gaussians is nearer to its own than this share of the way to the first layer.
const CLEAR: f32 = 0.25;
/// A layer that is shown within this many ray biases behind the first is in the shadow of what is not there.
const LID: f32 = 40.0;
/// Layers of the surface that a ray goes through at most.
const MOST_LAYERS: usize = 8;

/// What a view shows of the Gaussians, drawn as colors.
pub(crate) struct StandIn<'a> {
    scene: &'a RelightScene,
    rays: &'a Rays,
    painter: Painter,
    /// Colors are the reciprocal depth over that of the nearest Gaussian, since a far background that shines through counts little, and
    /// the confidence.
    nearness: Rendering,
    /// z of the nearest Gaussian.
    nearest: f32,
}

impl<'a> StandIn<'a> {
    /// `painter` holds the scene's Gaussians in the view of `rays`.
    pub(crate) fn new(
        scene: &'a RelightScene,
        rays: &'a Rays,
        mut painter: Painter,
        camera_from_world: &Pose,
    ) -> Self {
        let means = scene.gaussians.means.par_iter().with_min_len(1024);
        let depths: Vec<f32> = means
            .map(|p| camera_from_world.transform_point(Vec3::from(*p).as_dvec3()).z as f32)
            .collect();
        let positive = depths.iter().copied().filter(|z| *z > 0.0 && z.is_finite());
        let nearest = positive.fold(f32::INFINITY, f32::min).min(f32::MAX);
        let share = |i: usize| if depths[i] > 0.0 { nearest / depths[i] } else { 0.0 };
        let sure = |i: usize| scene.confidence.as_ref().map_or(1.0, |all| all[i]);
        let nearness = painter.paint(|i| [share(i), sure(i), 0.0]);
        Self { scene, rays, painter, nearness, nearest }
    }

    /// The normals, drawn as colors for [`Self::sight`].
    pub(crate) fn normals(&mut self) -> Rendering {
        let normals = &self.scene.materials.normals;
        self.painter.paint(|i| normals[i].map(|v| (0.5 + 0.5 * v).clamp(0.0, 1.0)))
    }

    /// The point of the surface at a place of the picture; `first` is the first triangle there, if that is known.
    pub(crate) fn surface(&self, first: Option<u32>, x: f64, y: f64) -> Option<Sight> {
        let (ray, cosine) = self.rays.through(x, y);
        let hit = match first {
            Some(triangle) => self.scene.hit_of(triangle, &ray)?,
            None => self.scene.first_hit(&ray)?,
        };
        let first = Sight::of(self.scene, &ray, cosine, &hit);
        Some(self.layer(first, &ray, cosine, x, y))
    }

    /// The layer of the surface that the Gaussians show: the first, or one behind it that they clearly show instead.
    fn layer(&self, first: Sight, ray: &Ray, cosine: f32, x: f64, y: f64) -> Sight {
        let step = self.scene.ray_bias();
        let apart = TriangleMesh::LAYERS * step;
        let (x, y) = (x as usize, y as usize);
        let alpha = self.nearness.alpha.pixel(x, y)[0];
        let tells = alpha >= COVERED && self.nearness.color.pixel(x, y)[1] >= SURE * alpha;
        let Some(depth) = self.depth(x, y).filter(|_| tells) else { return first };
        if !(step > 0.0 && depth > first.depth + apart) {
            return first;
        }
        let mut distance = first.depth / cosine;
        for _ in 0..MOST_LAYERS {
            let rest = Ray { t_min: step, ..Ray::new(ray.at(distance), ray.direction) };
            let Some(hit) = self.scene.first_hit(&rest) else { break };
            distance += hit.distance;
            let behind = distance * cosine;
            // Blended depths lie between what is in front and what is behind.
            let [from, to, shown] = [first.depth, behind, depth].map(f32::recip);
            let is_front = hit.hit.geometric_normal.dot(ray.direction) < 0.0;
            let is_apart = behind > first.depth + apart;
            if is_front && is_apart && (shown - to).abs() <= CLEAR * (from - to) {
                let in_false_shadow = behind <= first.depth + LID * step;
                let shown = Sight::of(self.scene, &rest, cosine, &hit);
                return Sight { depth: behind, in_false_shadow, ..shown };
            }
            if behind > depth + apart {
                break;
            }
        }
        first
    }

    /// The point that the Gaussians show in a pixel, with its normal of [`Self::normals`].
    pub(crate) fn sight(&self, normals: &Rendering, x: usize, y: usize) -> Option<Sight> {
        let depth = self.depth(x, y)?;
        let (ray, cosine) = self.rays.through(x as f64 + 0.5, y as f64 + 0.5);
        let to_viewer = -ray.direction;
        let encoded = Vec3::from_slice(normals.color.pixel(x, y));
        let encoded = encoded / self.nearness.alpha.pixel(x, y)[0];
        let normal = (2.0 * encoded - Vec3::ONE).normalize_or(to_viewer);
        let (position, normal) = (ray.at(depth / cosine), toward(normal, to_viewer));
        let emitted = Vec3::ZERO;
        let (on_surface, in_false_shadow) = (false, false);
        Some(Sight { position, normal, to_viewer, depth, on_surface, in_false_shadow, emitted })
    }

    /// z in the camera; none where there is nothing.
    fn depth(&self, x: usize, y: usize) -> Option<f32> {
        let alpha = self.nearness.alpha.pixel(x, y)[0];
        let share = self.nearness.color.pixel(x, y)[0] / alpha;
        let depth = self.nearest / share;
        (alpha >= LEAST_ALPHA && depth.is_finite()).then_some(depth)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use glam::DVec3;
    use motes_math::sigmoid::logit;
    use motes_raster::RenderOptions;
    use motes_scene::{Gaussians, Lobes, Materials, Pinhole, Surface};

    use super::*;
    use crate::first_triangles::first_triangles;

    const N: usize = 40;
    const EYE: f32 = 4.0;

    /// Places of a square from -1 to 1, at a height.
    fn places(height: f32) -> Vec<[f32; 3]> {
        let at = |i: usize| (i as f32 + 0.5) / N as f32 * 2.0 - 1.0;
        (0..N * N).map(|i| [at(i % N), at(i / N), height]).collect()
    }

    /// Layers of Gaussians that are `shown` at their heights, and layers of surface.
    pub(crate) fn scene(shown: &[f32], layers: &[f32]) -> RelightScene {
        let means: Vec<[f32; 3]> = shown.iter().flat_map(|h| places(*h)).collect();
        let n = means.len();
        let mut gaussians = Gaussians {
            means,
            rotations: vec![[1.0, 0.0, 0.0, 0.0]; n],
            log_scales: vec![[0.04f32.ln(), 0.04f32.ln(), 1e-3f32.ln()]; n],
            opacity_logits: vec![logit(0.99); n],
            sh: vec![0.0; 3 * n],
            ..Gaussians::empty(0)
        };
        let materials = Materials {
            normals: vec![[0.0, 0.0, 1.0]; n],
            base_color_linear: vec![[0.5; 3]; n],
            roughness: vec![1.0; n],
            metallic: vec![0.0; n],
            visibility: vec![1.0; n],
            observations: vec![9; n],
        };
        materials.attach(&mut gaussians);
        let mut surface = Surface::default();
        for height in layers {
            let first = surface.vertices.len();
            surface.vertices.extend(places(*height));
            for i in (0..N * (N - 1)).filter(|i| i % N + 1 < N) {
                let [a, b] = [first + i, first + i + N].map(|v| v as u32);
                surface.triangles.extend([[a, a + 1, b], [b, a + 1, b + 1]]);
            }
        }
        let n = surface.vertices.len();
        surface.normals = vec![[0.0, 0.0, 1.0]; n];
        surface.base_color_linear = vec![[0.5; 3]; n];
        (surface.roughness, surface.metallic) = (vec![1.0; n], vec![0.0; n]);
        RelightScene::new(gaussians, surface, Lobes::Lambert, false, Vec3::Z).expect("a scene")
    }

    /// Depths in the middle of the picture: at its first triangle, and of a ray beside it.
    fn seen(shown: &[f32], layers: &[f32]) -> [Option<f32>; 2] {
        seen_in(&scene(shown, layers))
    }

    fn seen_in(scene: &RelightScene) -> [Option<f32>; 2] {
        sights_in(scene).map(|sight| sight.map(|s| s.depth))
    }

    fn sights_in(scene: &RelightScene) -> [Option<Sight>; 2] {
        let camera = Pinhole { width: 30, height: 30, fx: 90.0, fy: 90.0, cx: 15.0, cy: 15.0 };
        let eye = DVec3::new(0.0, 0.0, f64::from(EYE));
        let rotation = glam::DQuat::from_rotation_x(std::f64::consts::PI);
        let pose = Pose { rotation, translation: -(rotation * eye) };
        let rays = Rays::new(&camera, &pose);
        let (painter, _) =
            Painter::new(&scene.base_color_splats, &camera, &pose, &RenderOptions::default());
        let stand_in = StandIn::new(scene, &rays, painter, &pose);
        let first = first_triangles(&scene.surface, &camera, &pose)[15 * 30 + 15];
        [stand_in.surface(Some(first), 15.5, 15.5), stand_in.surface(None, 14.25, 14.75)]
    }

    fn assert_depth(found: [Option<f32>; 2], depth: f32) {
        assert!(found.iter().all(|z| (z.unwrap() - depth).abs() < 1e-3), "{found:?} {depth}");
    }

    #[test]
    fn the_layer_that_the_gaussians_show_is_seen() {
        // A layer over the floor without Gaussians: the floor is shown. With them, or without another layer, it is what it is.
        assert_depth(seen(&[0.0], &[0.0, 2.0]), EYE);
        assert_depth(seen(&[0.0], &[0.0, 1.5, 2.0]), EYE);
        assert_depth(seen(&[0.0, 2.0], &[0.0, 2.0]), EYE - 2.0);
        assert_depth(seen(&[0.0], &[2.0]), EYE - 2.0);
        assert_depth(seen(&[1.4], &[0.0, 1.5, 2.0]), EYE - 1.5);
        // Layers that touch are one.
        assert_depth(seen(&[0.0], &[0.0, 0.01]), EYE - 0.01);
    }

    #[test]
    fn a_layer_right_under_one_that_is_not_there_is_in_its_shadow() {
        let bias = scene(&[0.0], &[0.0]).ray_bias;
        let found = |biases: f32| {
            let sights = sights_in(&scene(&[0.0], &[0.0, biases * bias])).map(Option::unwrap);
            assert_depth(sights.map(|s| Some(s.depth)), EYE);
            sights.map(|s| (s.on_surface, s.in_false_shadow))
        };
        assert_eq!(found(0.5 * LID), [(true, true); 2]);
        assert_eq!(found(1.2 * LID), [(true, false); 2]);
    }

    #[test]
    fn gaussians_that_surface_and_photos_contradict_tell_no_layer() {
        let mut scene = scene(&[0.0], &[0.0, 2.0]);
        for (confidence, depth) in [(0.1, EYE - 2.0), (0.9, EYE)] {
            scene.confidence = Some(vec![confidence; scene.gaussians.len()]);
            assert_depth(seen_in(&scene), depth);
        }
    }

    #[test]
    fn gaussians_behind_the_camera_and_without_a_place_say_nothing() {
        assert_depth(seen(&[f32::NAN], &[0.0, 2.0]), EYE - 2.0);
        assert_depth(seen(&[9.0], &[0.0, 2.0]), EYE - 2.0);
    }
}
