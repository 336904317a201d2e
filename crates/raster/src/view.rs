//! A camera as projection reads it.

use fearless_simd::Simd;
use glam::{Mat3, Vec3};
use motes_scene::{Pinhole, Pose};

use crate::lanes::{Vec3s, three};

/// One view in single precision, with the camera center kept apart from the rotation so that
/// `mean - center` cancels before anything is rounded.
#[derive(Clone, Debug)]
pub struct ViewTransform {
    /// Rotation world to camera.
    pub rotation: Mat3,
    /// Camera center in world.
    pub center: Vec3,
    /// What single precision leaves of it: a Gaussian close to a camera far from the origin would
    /// otherwise be off by the rounding of the camera.
    center_rest: Vec3,
    /// Focal lengths, pixels.
    pub focal: [f32; 2],
    /// Principal point, pixels.
    pub principal: [f32; 2],
    /// Image size, pixels.
    pub size: [usize; 2],
    /// Bounds of `x/z` and `y/z` inside which the Jacobian is evaluated: the field of view and
    /// 30 % of its half width around it, where the linearization still holds.
    pub(crate) slope_min: [f32; 2],
    pub(crate) slope_max: [f32; 2],
}

impl ViewTransform {
    /// From intrinsics and pose.
    pub fn new(camera: &Pinhole, camera_from_world: &Pose) -> Self {
        let (w, h) = (camera.width as f64, camera.height as f64);
        let exact = camera_from_world.center_in_world();
        let center = exact.as_vec3();
        let margin = [0.15 * w / camera.fx, 0.15 * h / camera.fy];
        Self {
            rotation: camera_from_world.rotation_matrix().as_mat3(),
            center,
            center_rest: (exact - center.as_dvec3()).as_vec3(),
            focal: [camera.fx as f32, camera.fy as f32],
            principal: [camera.cx as f32, camera.cy as f32],
            size: [camera.width, camera.height],
            slope_min: [
                (-camera.cx / camera.fx - margin[0]) as f32,
                (-camera.cy / camera.fy - margin[1]) as f32,
            ],
            slope_max: [
                ((w - camera.cx) / camera.fx + margin[0]) as f32,
                ((h - camera.cy) / camera.fy + margin[1]) as f32,
            ],
        }
    }

    /// From the camera center to a point, world axes.
    #[inline]
    pub fn offset_to(&self, point: [f32; 3]) -> Vec3 {
        (Vec3::from(point) - self.center) - self.center_rest
    }

    /// The same for a point per lane.
    #[inline(always)]
    pub(crate) fn lanes_to<S: Simd>(&self, points: Vec3s<S>) -> Vec3s<S> {
        let (center, rest) = (self.center.to_array(), self.center_rest.to_array());
        three!(k => (points[k] - center[k]) - rest[k])
    }
}
