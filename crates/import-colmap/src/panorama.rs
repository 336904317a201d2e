//! Equirectangular photos as pinhole crops.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use motes_scene::{Camera, CameraModel, ImageU8, Pinhole, Pose};

/// Crops per panorama, turned by equal angles about the camera's vertical axis.
pub(crate) const CROPS: usize = 8;

/// Whether a camera is a panorama.
pub(crate) fn is_panorama(camera: &Camera) -> bool {
    camera.model == CameraModel::Equirectangular
}

/// The camera of every crop: square, 90 degrees wide, as many pixels as that quarter turn has in
/// the panorama.
pub(crate) fn crop_pinhole(panorama_width: usize) -> Pinhole {
    let side = (panorama_width / 4).max(1);
    let (f, c) = (0.5 * side as f64, 0.5 * side as f64);
    Pinhole { fx: f, fy: f, cx: c, cy: c, width: side, height: side }
}

/// `crop_from_panorama`: the crop looks to the right of the panorama's center by
/// `crop / CROPS` turns.
fn rotation(crop: usize) -> DQuat {
    DQuat::from_rotation_y(-TAU * crop as f64 / CROPS as f64)
}

/// `camera_from_world` of a crop.
pub(crate) fn crop_pose(panorama_from_world: &Pose, crop: usize) -> Pose {
    Pose { rotation: rotation(crop), translation: DVec3::ZERO }.compose(panorama_from_world)
}

/// Direction in the panorama's frame of a direction in a crop's frame.
pub(crate) fn direction_in_panorama(crop: usize, direction_in_crop: DVec3) -> DVec3 {
    rotation(crop).conjugate() * direction_in_crop
}

/// Name of a crop: `hall.jpg` becomes `hall_yaw045.jpg`.
pub(crate) fn crop_name(name: &str, crop: usize) -> String {
    let degrees = 360 * crop / CROPS;
    match name.rsplit_once('.') {
        Some((stem, suffix)) if !suffix.contains('/') => format!("{stem}_yaw{degrees:03}.{suffix}"),
        _ => format!("{name}_yaw{degrees:03}"),
    }
}

/// Pixels added on both sides so that filters reach over the seam.
pub(crate) const SEAM: usize = 32;

/// The panorama with its ends repeated on the other side.
pub(crate) fn with_seam(image: &ImageU8) -> ImageU8 {
    let seam = SEAM.min(image.width);
    let (stride, c) = (image.width * image.channels, image.channels);
    let mut data = Vec::with_capacity((image.width + 2 * seam) * image.height * c);
    for row in image.data.chunks_exact(stride) {
        data.extend_from_slice(&row[stride - seam * c..]);
        data.extend_from_slice(row);
        data.extend_from_slice(&row[..seam * c]);
    }
    ImageU8::from_data(image.width + 2 * seam, image.height, c, data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crops_look_to_the_right_in_turn() {
        let forward = direction_in_panorama(2, DVec3::Z);
        assert!((forward - DVec3::X).length() < 1e-12, "a quarter turn to the right: {forward}");
        let world = Pose::look_at(DVec3::new(3.0, 1.0, 0.5), DVec3::ZERO, DVec3::Z).unwrap();
        for crop in 0..CROPS {
            let pose = crop_pose(&world, crop);
            assert!((pose.center_in_world() - world.center_in_world()).length() < 1e-12);
            let ahead = pose.inverse().transform_point(DVec3::Z);
            let expected = world.inverse().transform_point(direction_in_panorama(crop, DVec3::Z));
            assert!((ahead - expected).length() < 1e-12);
        }
        assert_eq!(crop_name("a.b/hall.jpg", 1), "a.b/hall_yaw045.jpg");
        assert_eq!(crop_name("a.b/hall", 7), "a.b/hall_yaw315");
    }
}
