//! What a view shows of the shape of a Gaussian.

use glam::{Mat3, Quat, Vec3};
use motes_scene::Gaussians;

use crate::options::BLUR_VARIANCE_PX2;
use crate::view::ViewTransform;

/// What a view shows of the shape of a Gaussian. The depth of its center would do for a small one; a wide one that is seen at a grazing
/// angle covers many depths.
#[derive(Clone, Copy, Default)]
pub(super) struct WorldShape {
    /// Its shortest axis, turned toward the camera, world.
    pub(super) normal: Vec3,
    /// From the camera frame to the axes of the Gaussian in units of its standard deviations.
    to_local: Mat3,
    /// Its center in those, from the camera.
    center: Vec3,
    /// Three of its largest standard deviations: depth changes by no more.
    reach: f32,
}

impl WorldShape {
    pub(super) fn new(gaussians: &Gaussians, i: usize, view: &ViewTransform) -> Self {
        let [w, x, y, z] = gaussians.rotations[i];
        let axes = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
        let offset = view.offset_to(gaussians.means[i]);
        // Nothing is thinner than the blur of the picture.
        let pixel = view.rotation.row(2).dot(offset) / view.focal[0].max(view.focal[1]);
        let blur = BLUR_VARIANCE_PX2.sqrt() * pixel;
        let sigmas = Vec3::from(gaussians.log_scales[i]).exp().max(Vec3::splat(blur.max(1e-30)));
        let whiten = Mat3::from_diagonal(sigmas.recip()) * axes.transpose();
        Self {
            normal: facing_normal(axes, gaussians, i, view),
            to_local: whiten * view.rotation.transpose(),
            center: whiten * offset,
            reach: 3.0 * sigmas.max_element(),
        }
    }

    /// Depth at which a ray whose direction has depth 1 passes the densest point, near that of the center.
    #[inline(always)]
    pub(super) fn depth(&self, ray: Vec3, center_depth: f32) -> f32 {
        let d = self.to_local * ray;
        let peak = d.dot(self.center) / d.length_squared();
        let (near, far) = (center_depth - self.reach, center_depth + self.reach);
        // What is around the camera has no depth but that of its center.
        if near > 0.0 && peak.is_finite() { peak.clamp(near, far) } else { center_depth }
    }
}

/// The shortest axis of a Gaussian, turned toward the camera.
fn facing_normal(axes: Mat3, gaussians: &Gaussians, i: usize, view: &ViewTransform) -> Vec3 {
    let s = gaussians.log_scales[i];
    let shortest = (1..3).fold(0, |best, k| if s[k] < s[best] { k } else { best });
    let normal = axes.col(shortest);
    let to_camera = view.center - Vec3::from(gaussians.means[i]);
    if normal.dot(to_camera) < 0.0 { -normal } else { normal }
}
