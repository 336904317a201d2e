//! A posed photo prepared for finding points in it.

use glam::{DMat3, DVec2, DVec3};
use motes_math::resample::{Filter, resize};
use motes_scene::{Pinhole, Pose};

use super::keypoints::{Keypoint, keypoints};
use super::scale_space::Gray;
use crate::options::AlphaMode;
use crate::target::TrainingImage;

/// Luminance that stands behind transparent pixels.
const BEHIND: f32 = 0.5;
/// Opacity, of 255, from which a pixel belongs to the object.
const OPAQUE: u8 = 128;

/// A photo at matching size and its keypoints.
pub(super) struct View {
    pub(super) camera: Pinhole,
    pub(super) camera_from_world: Pose,
    pub(super) center: DVec3,
    pub(super) luma: Gray,
    rgb: Vec<u8>,
    pub(super) keypoints: Vec<Keypoint>,
}

impl View {
    /// Reduces the photo to a long side of at most `long_side` and finds up to `most` keypoints.
    pub(super) fn new(
        image: &TrainingImage,
        long_side: usize,
        most: usize,
        alpha_mode: AlphaMode,
    ) -> Self {
        let (w, h) = (image.camera.width, image.camera.height);
        let scale = (long_side as f64 / w.max(h) as f64).min(1.0);
        let side = |length: usize| ((length as f64 * scale).round() as usize).max(1);
        let camera = image.camera.resized(side(w), side(h));
        let size = (camera.width, camera.height);
        let shrink = |data: Vec<f32>, channels: usize| match (w, h) == size {
            true => data,
            false => resize(&data, (w, h, channels), size, Filter::Lanczos3),
        };
        let source = image.image.to_f32();
        let channels = source.channels;
        let data = shrink(source.data, channels);
        let has_alpha = channels == 4 && alpha_mode != AlphaMode::Ignore;
        let mask = image.mask.as_ref().map(|mask| shrink(mask.to_f32().data, 1));
        let (mut luma, mut rgb, mut counts) = (Vec::new(), Vec::new(), Vec::new());
        for (i, p) in data.chunks_exact(channels).enumerate() {
            let c = |k: usize| p[k.min(channels - 1)];
            let alpha = if has_alpha { c(3).clamp(0.0, 1.0) } else { 1.0 };
            let gray = 0.299 * c(0) + 0.587 * c(1) + 0.114 * c(2);
            luma.push(alpha * gray + (1.0 - alpha) * BEHIND);
            rgb.extend([0, 1, 2].map(|k| (c(k).clamp(0.0, 1.0) * 255.0).round() as u8));
            let masked = mask.as_ref().is_some_and(|mask| mask[i] < 0.5);
            counts.push(!masked && alpha * 255.0 >= f32::from(OPAQUE));
        }
        let luma = Gray { width: size.0, height: size.1, data: luma };
        let keypoints = keypoints(&luma, most, |x, y| counts[y * size.0 + x]);
        let camera_from_world = image.camera_from_world;
        let center = camera_from_world.center_in_world();
        Self { camera, camera_from_world, center, luma, rgb, keypoints }
    }

    /// Pixel and depth of a point in front of the camera and on the photo.
    pub(super) fn project(&self, point: DVec3) -> Option<(DVec2, f64)> {
        let p = self.camera_from_world.transform_point(point);
        let pixel = DVec2::new(
            self.camera.fx * p.x / p.z + self.camera.cx,
            self.camera.fy * p.y / p.z + self.camera.cy,
        );
        let inside = p.z > 0.0
            && pixel.cmpge(DVec2::ZERO).all()
            && pixel.x < self.camera.width as f64
            && pixel.y < self.camera.height as f64;
        inside.then_some((pixel, p.z))
    }

    /// Direction of a pixel's ray in the world, with a depth of one.
    pub(super) fn ray(&self, x: f64, y: f64) -> DVec3 {
        let c = &self.camera;
        let in_camera = DVec3::new((x - c.cx) / c.fx, (y - c.cy) / c.fy, 1.0);
        self.camera_from_world.rotation.conjugate() * in_camera
    }

    pub(super) fn color(&self, x: f32, y: f32) -> [u8; 3] {
        let x = (x as usize).min(self.camera.width - 1);
        let y = (y as usize).min(self.camera.height - 1);
        let at = 3 * (y * self.camera.width + x);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    fn intrinsics(&self) -> DMat3 {
        let c = &self.camera;
        DMat3::from_cols(
            DVec3::new(c.fx, 0.0, 0.0),
            DVec3::new(0.0, c.fy, 0.0),
            DVec3::new(c.cx, c.cy, 1.0),
        )
    }
}

/// What two poses say about where a pixel of one photo lies in the other.
pub(super) enum TwoViews {
    /// Different places: `lineᵦ = F (x, y, 1)`.
    Epipolar(DMat3),
    /// One place: `(x', y') ~ H (x, y, 1)`.
    Rotation(DMat3),
}

impl TwoViews {
    /// Of `a` and `b`; centers closer than `one_place` are in one place.
    pub(super) fn new(a: &View, b: &View, one_place: f64) -> Self {
        let b_from_a = b.camera_from_world.compose(&a.camera_from_world.inverse());
        let rotation = b_from_a.rotation_matrix();
        if a.center.distance(b.center) <= one_place {
            return Self::Rotation(b.intrinsics() * rotation * a.intrinsics().inverse());
        }
        let t = b_from_a.translation;
        let cross = DMat3::from_cols(
            DVec3::new(0.0, t.z, -t.y),
            DVec3::new(-t.z, 0.0, t.x),
            DVec3::new(t.y, -t.x, 0.0),
        );
        let fundamental =
            b.intrinsics().inverse().transpose() * cross * rotation * a.intrinsics().inverse();
        Self::Epipolar(fundamental)
    }

    /// Pixels of the second photo between `q` and where `p` of the first may lie.
    pub(super) fn distance(&self, p: DVec2, q: DVec2) -> f64 {
        let (p, q) = (p.extend(1.0), q.extend(1.0));
        match self {
            Self::Epipolar(fundamental) => {
                let line = *fundamental * p;
                line.dot(q).abs() / line.truncate().length().max(1e-300)
            }
            Self::Rotation(homography) => {
                let r = *homography * p;
                if r.z > 0.0 { (r / r.z - q).truncate().length() } else { f64::INFINITY }
            }
        }
    }
}
