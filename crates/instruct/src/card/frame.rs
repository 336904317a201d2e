//! What left, right, front and up are.

use glam::DVec3;
use motes_formats::scene_card::FrameDocument;
use motes_scene::Capture;

/// A camera that looks along up says nothing about the front beyond this sine.
const LEAST_SINE: f64 = 0.05;

/// The frame of a view: right is that of the picture, laid on the ground; front is toward the camera. Without a capture right is the
/// world's x axis (its y axis where x is up).
pub(super) fn frame(capture: Option<(&Capture, usize)>, up: DVec3) -> FrameDocument {
    let level = |v: DVec3| (v - up * v.dot(up)).try_normalize();
    let of_view = capture.and_then(|(capture, view)| {
        let view = &capture.views[view];
        let world_from_camera = view.camera_from_world.rotation_matrix().transpose();
        let flat = |v: DVec3| (v - up * v.dot(up)).length() > LEAST_SINE;
        let (right, forward) = (world_from_camera * DVec3::X, world_from_camera * DVec3::Z);
        // The sideways axis of a camera on its side is not level.
        let right = if flat(forward) { forward.cross(up) } else { right };
        Some((view.name.clone(), level(right)?))
    });
    let world = || level(DVec3::X).filter(|_| up.x.abs() < 0.99).or_else(|| level(DVec3::Y));
    let (view, right) = match of_view {
        Some((name, right)) => (Some(name), right),
        None => (None, world().unwrap_or(DVec3::Y)),
    };
    FrameDocument {
        view,
        up: up.to_array(),
        right: right.to_array(),
        front: right.cross(up).normalize_or_zero().to_array(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_view_right_is_x_and_the_axes_are_a_right_handed_frame() {
        let frame = frame(None, DVec3::Z);
        assert_eq!(frame.right, [1.0, 0.0, 0.0]);
        // Who sees x to the right and z up looks along +y: in front is -y.
        assert_eq!(frame.front, [0.0, -1.0, 0.0]);
        let up_x = super::frame(None, DVec3::X);
        assert_eq!(up_x.right, [0.0, 1.0, 0.0]);
    }
}
