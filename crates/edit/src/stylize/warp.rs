//! What one view sees of another, by depth.

use glam::{DVec3, Vec3};
use motes_raster::{Antialias, RenderOptions, render};
use motes_scene::{Gaussians, ImageF32};

use super::{StyleView, pixel};

/// A point is seen when its depth agrees with that of the picture to this share.
const DEPTH_TOLERANCE: f64 = 0.02;
/// Pixels of less coverage have no depth to go by.
const LEAST_ALPHA: f32 = 0.5;

/// A view with what is needed to find its pixels in others.
pub(super) struct Sight {
    view: StyleView,
    /// Before any edit.
    pub(super) color: ImageF32,
    /// Depth at which half of the light is absorbed, 0 where nothing is.
    depth: ImageF32,
    /// Share of each pixel that the chosen Gaussians have, `[h, w, 1]`.
    pub(super) share: ImageF32,
}

impl Sight {
    pub(super) fn new(
        gaussians: &Gaussians,
        chosen: &[bool],
        antialias: Antialias,
        view: &StyleView,
    ) -> Self {
        let options = RenderOptions { antialias, aovs: true, ..RenderOptions::default() };
        let (camera, pose) = (&view.camera, &view.camera_from_world);
        let shown = render(gaussians, camera, pose, &options);
        let mut depth = match shown.aovs {
            Some(aovs) => aovs.depth_median,
            None => ImageF32::filled(camera.width, camera.height, 1, 0.0),
        };
        for (d, alpha) in depth.data.iter_mut().zip(&shown.alpha.data) {
            if !(*alpha >= LEAST_ALPHA) {
                *d = 0.0;
            }
        }
        let plain = RenderOptions { antialias, ..RenderOptions::default() };
        let mask =
            render(&gaussians.colored(|i| [f32::from(chosen[i]); 3]), camera, pose, &plain).color;
        let share = mask.data.chunks_exact(3).map(|p| p[0].max(0.0).clamp(0.0, 1.0)).collect();
        let share = ImageF32::from_data(camera.width, camera.height, 1, share);
        Self { view: view.clone(), color: shown.color, depth, share }
    }

    /// Number of pixels.
    pub(super) fn pixels(&self) -> usize {
        self.depth.data.len()
    }

    /// The surface point of a pixel, world.
    fn point(&self, at: usize) -> Option<DVec3> {
        let depth = f64::from(self.depth.data[at]);
        if !(depth > 0.0) {
            return None;
        }
        let camera = &self.view.camera;
        let (x, y) = (at % camera.width, at / camera.width);
        let p = DVec3::new(
            (x as f64 + 0.5 - camera.cx) / camera.fx * depth,
            (y as f64 + 0.5 - camera.cy) / camera.fy * depth,
            depth,
        );
        Some(self.view.camera_from_world.inverse().transform_point(p))
    }

    /// What `picture`, which is of this view, shows at a point of the world, when the point is seen.
    fn look(&self, picture: &ImageF32, point: DVec3) -> Option<Vec3> {
        let p = self.view.camera_from_world.transform_point(point);
        let camera = &self.view.camera;
        if !(p.z > 0.0) {
            return None;
        }
        let (u, v) =
            (camera.fx * p.x / p.z + camera.cx - 0.5, camera.fy * p.y / p.z + camera.cy - 0.5);
        let inside =
            u >= 0.0 && v >= 0.0 && u < (camera.width - 1) as f64 && v < (camera.height - 1) as f64;
        if !inside {
            return None;
        }
        let (x, y) = (u as usize, v as usize);
        let nearest = (v.round() as usize) * camera.width + u.round() as usize;
        let seen = f64::from(self.depth.data[nearest]);
        if !((p.z - seen).abs() <= DEPTH_TOLERANCE * p.z) {
            return None;
        }
        let (a, b) = ((u - x as f64) as f32, (v - y as f64) as f32);
        let at = y * camera.width + x;
        let top = pixel(picture, at) * (1.0 - a) + pixel(picture, at + 1) * a;
        let below = at + camera.width;
        let bottom = pixel(picture, below) * (1.0 - a) + pixel(picture, below + 1) * a;
        Some(top * (1.0 - b) + bottom * b)
    }
}

/// What the pictures of `sources` show at the pixels of `sight`: weighted mean and sum of weights, `[h w]`.
pub(super) fn seen_by(sight: &Sight, sources: &[(&Sight, &ImageF32, f32)]) -> Vec<(Vec3, f32)> {
    use rayon::prelude::*;
    (0..sight.pixels())
        .into_par_iter()
        .map(|at| {
            let Some(point) = sight.point(at) else { return (Vec3::ZERO, 0.0) };
            let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
            for (source, picture, weight) in sources {
                if let Some(color) = source.look(picture, point) {
                    sum += color * *weight;
                    weights += weight;
                }
            }
            if weights > 0.0 { (sum / weights, weights) } else { (Vec3::ZERO, 0.0) }
        })
        .collect()
}
