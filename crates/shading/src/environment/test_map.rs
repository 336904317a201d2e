//! A map in which every world axis can be recognized, to check conventions by eye and by test.

use glam::{DVec3, Vec3};
use motes_scene::ImageF32;

use super::{Orientation, direction_from_uv};

/// What shows along +x, -x, +y, -y, +z, -z: red, cyan, green, magenta, blue, yellow.
pub const AXIS_COLORS: [(DVec3, Vec3); 6] = [
    (DVec3::X, Vec3::new(1.0, 0.0, 0.0)),
    (DVec3::NEG_X, Vec3::new(0.0, 1.0, 1.0)),
    (DVec3::Y, Vec3::new(0.0, 1.0, 0.0)),
    (DVec3::NEG_Y, Vec3::new(1.0, 0.0, 1.0)),
    (DVec3::Z, Vec3::new(0.0, 0.0, 1.0)),
    (DVec3::NEG_Z, Vec3::new(1.0, 1.0, 0.0)),
];

/// A lat-long picture of `2 height` x `height` as a program with this orientation would write it:
/// discs of 20 degrees round the world axes in [`AXIS_COLORS`], negative ones with a black
/// center of 8 degrees; the upper half of the map gray 0.2, the lower 0.05.
pub fn axis_test_map(height: usize, orientation: &Orientation) -> ImageF32 {
    let width = 2 * height;
    let mut image = ImageF32::filled(width, height, 3, 0.0);
    for y in 0..height {
        for x in 0..width {
            let (u, v) = ((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
            let world = orientation.world_from_map(direction_from_uv(u, v));
            let mut color = Vec3::splat(if v < 0.5 { 0.2 } else { 0.05 });
            for (i, (axis, axis_color)) in AXIS_COLORS.into_iter().enumerate() {
                let angle = world.angle_between(axis).to_degrees();
                if angle < 20.0 {
                    let hole = i % 2 == 1 && angle < 8.0;
                    color = if hole { Vec3::ZERO } else { axis_color };
                }
            }
            image.pixel_mut(x, y).copy_from_slice(&color.to_array());
        }
    }
    image
}
