//! The light beside the mesh: a lat-long map in the target's orientation.

use glam::DVec3;
use motes_scene::ImageF32;
use motes_shading::environment::{Environment, Orientation, direction_from_uv};

use super::target::{GltfFrame, Target};

/// `light` (photo units, world axes) as a map of `height` rows and twice as many columns, as `target`
/// wants it. Values are bilinear; where the axes only change names, no pixel moves.
pub fn environment_for(
    light: &Environment,
    frame: &GltfFrame,
    target: Target,
    height: usize,
) -> ImageF32 {
    let (width, height) = (2 * height.max(1), height.max(1));
    let orientation = Orientation::new(target.map_convention());
    let mut image = ImageF32::filled(width, height, 3, 0.0);
    let world_from_gltf = frame.rotation.transpose();
    for y in 0..height {
        for x in 0..width {
            let (u, v) = ((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
            let gltf = orientation.world_from_map(direction_from_uv(u, v));
            let world: DVec3 = world_from_gltf * gltf;
            let radiance = light.radiance_pdf(world.as_vec3().normalize()).0;
            image.pixel_mut(x, y).copy_from_slice(&radiance.to_array());
        }
    }
    image
}
