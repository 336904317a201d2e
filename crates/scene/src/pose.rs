//! Rigid transforms.

use glam::{DMat3, DQuat, DVec3};

/// A rigid transform `p_a = rotation * p_b + translation`, named `a_from_b` at each use.
///
/// Double precision: poses are few, and a world may sit at map coordinates (1e7 m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Translation, world units.
    pub translation: DVec3,
}

impl Pose {
    /// The transform that changes nothing.
    pub const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    /// Builds a pose, normalizing the quaternion. Returns `None` when the rotation has no
    /// direction (zero or non-finite quaternion) or the translation is not finite.
    pub fn new(rotation: DQuat, translation: DVec3) -> Option<Self> {
        let norm = rotation.length();
        if norm > 1e-12 && norm.is_finite() && translation.is_finite() {
            Some(Self { rotation: rotation * (1.0 / norm), translation })
        } else {
            None
        }
    }

    /// The inverse transform: `b_from_a` of an `a_from_b`.
    pub fn inverse(&self) -> Self {
        let inverse_rotation = self.rotation.conjugate();
        Self { rotation: inverse_rotation, translation: -(inverse_rotation * self.translation) }
    }

    /// `a_from_b.compose(b_from_c)` is `a_from_c`.
    pub fn compose(&self, other: &Self) -> Self {
        Self {
            rotation: (self.rotation * other.rotation).normalize(),
            translation: self.rotation * other.translation + self.translation,
        }
    }

    /// Maps a point.
    pub fn transform_point(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// For a `camera_from_world`: the center of projection in world coordinates.
    pub fn center_in_world(&self) -> DVec3 {
        self.inverse().translation
    }

    /// The rotation as a matrix with column vectors.
    pub fn rotation_matrix(&self) -> DMat3 {
        DMat3::from_quat(self.rotation)
    }

    /// The pose at `t` in [0, 1] between two `camera_from_world` poses: the camera center moves
    /// on a line and the orientation along the shortest arc at constant speed.
    pub fn between(camera_a_from_world: &Self, camera_b_from_world: &Self, t: f64) -> Self {
        let (a, b) = (camera_a_from_world.inverse(), camera_b_from_world.inverse());
        Self {
            rotation: a.rotation.slerp(b.rotation, t),
            translation: a.translation.lerp(b.translation, t),
        }
        .inverse()
    }

    /// A `camera_from_world` at `eye` that looks at `target`, with `up` upwards in the image.
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Option<Self> {
        let forward = (target - eye).try_normalize()?;
        let right = forward.cross(up).try_normalize()?;
        let down = forward.cross(right);
        let world_from_camera = DMat3::from_cols(right, down, forward);
        Self::new(DQuat::from_mat3(&world_from_camera), eye).map(|pose| pose.inverse())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> (Pose, Pose) {
        let a = Pose::look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO, DVec3::Z).unwrap();
        let b = Pose::look_at(DVec3::new(-2.0, 2.0, 1.0), DVec3::ZERO, DVec3::Z).unwrap();
        (a, b)
    }

    #[test]
    fn inverse_undoes() {
        let (a, b) = sample();
        let p = DVec3::new(0.3, -0.4, 5.0);
        let q = a.inverse().transform_point(a.transform_point(p));
        assert!((p - q).length() < 1e-12);
        let r = a.compose(&b).transform_point(p);
        assert!((r - a.transform_point(b.transform_point(p))).length() < 1e-12);
    }

    #[test]
    fn look_at_faces_the_target_and_keeps_up() {
        let (a, _) = sample();
        let target_in_camera = a.transform_point(DVec3::ZERO);
        assert!(target_in_camera.x.abs() < 1e-12 && target_in_camera.y.abs() < 1e-12);
        assert!((target_in_camera.z - 14f64.sqrt()).abs() < 1e-12);
        let above = a.transform_point(DVec3::Z);
        assert!(above.y < 0.0, "up in the world must be -y in the camera: {above}");
    }

    #[test]
    fn between_meets_both_ends() {
        let (a, b) = sample();
        for (t, end) in [(0.0, a), (1.0, b)] {
            let pose = Pose::between(&a, &b, t);
            assert!((pose.center_in_world() - end.center_in_world()).length() < 1e-12);
            assert!(pose.rotation.dot(end.rotation).abs() > 1.0 - 1e-12);
        }
        let middle = Pose::between(&a, &b, 0.5).center_in_world();
        assert!((middle - DVec3::new(-0.5, 2.0, 2.0)).length() < 1e-12);
    }

    #[test]
    fn a_rotation_without_direction_is_refused() {
        assert!(Pose::new(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), DVec3::ZERO).is_none());
        assert!(Pose::new(DQuat::from_xyzw(f64::NAN, 0.0, 0.0, 1.0), DVec3::ZERO).is_none());
        assert!(Pose::new(DQuat::IDENTITY, DVec3::new(f64::INFINITY, 0.0, 0.0)).is_none());
    }
}
