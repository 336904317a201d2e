//! A lat-long map from six square pictures around a point.

use glam::{DMat3, DQuat, DVec3, Vec3};
use motes_scene::{ImageF32, Pinhole, Pose};
use motes_shading::environment::Orientation;

use crate::sphere::texel_direction;

/// Faces overlap by this factor, so that no look-up leaves one.
const TANGENT: f64 = 1.05;

/// The map of `rows` rows that `render` (linear RGB of a camera) shows around `at`, in the axes of `orientation`.
///
/// # Errors
/// Those of `render`.
pub fn map_of_faces<E>(
    at: DVec3,
    orientation: &Orientation,
    rows: usize,
    mut render: impl FnMut(&Pinhole, &Pose) -> Result<ImageF32, E>,
) -> Result<ImageF32, E> {
    let size = ((2.0 * rows as f64 / std::f64::consts::PI * TANGENT).ceil() as usize).max(8);
    let half = size as f64 / 2.0;
    let focal = half / TANGENT;
    let camera = Pinhole { fx: focal, fy: focal, cx: half, cy: half, width: size, height: size };
    let axes = faces();
    let mut pictures = Vec::new();
    for world_from_camera in &axes {
        let rotation = DQuat::from_mat3(&world_from_camera.transpose()).normalize();
        pictures.push(render(&camera, &Pose { rotation, translation: -(rotation * at) })?);
    }
    let (w, h) = (2 * rows, rows);
    let mut map = ImageF32::filled(w, h, 3, 0.0);
    for i in 0..w * h {
        let d = orientation.world_from_map(texel_direction(i % w, i / w, w, h));
        let ahead = |f: &usize| axes[*f].col(2).dot(d);
        let face = (0..6).max_by(|a, b| ahead(a).total_cmp(&ahead(b))).unwrap_or(0);
        let q = axes[face].transpose() * d;
        let value = bilinear(&pictures[face], focal * q.x / q.z + half, focal * q.y / q.z + half);
        map.data[3 * i..3 * i + 3].copy_from_slice(&value.to_array());
    }
    Ok(map)
}

/// Cameras along the axes of the world, `world_from_camera`: x right, y down, z forward.
fn faces() -> [DMat3; 6] {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    [(x, z), (-x, z), (y, z), (-y, z), (z, x), (-z, x)].map(|(ahead, up)| {
        let right = ahead.cross(up);
        DMat3::from_cols(right, ahead.cross(right), ahead)
    })
}

fn bilinear(picture: &ImageF32, u: f64, v: f64) -> Vec3 {
    let (w, h) = (picture.width, picture.height);
    let clamp = |t: f64, n: usize| (t - 0.5).clamp(0.0, (n - 1) as f64);
    let (x, y) = (clamp(u, w), clamp(v, h));
    let (x0, y0) = (x as usize, y as usize);
    let (s, t) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
    let at = |x: usize, y: usize| Vec3::from_slice(picture.pixel(x.min(w - 1), y.min(h - 1)));
    let top = at(x0, y0).lerp(at(x0 + 1, y0), s);
    top.lerp(at(x0, y0 + 1).lerp(at(x0 + 1, y0 + 1), s), t)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use motes_shading::environment::Convention;

    use super::*;

    #[test]
    fn faces_show_every_direction_where_it_belongs() {
        let orientation = Orientation::new(Convention::Blender);
        let at = DVec3::new(3.0, -2.0, 1.0);
        // A picture whose colors are the directions of its pixels.
        let render = |camera: &Pinhole, pose: &Pose| {
            assert!((pose.center_in_world() - at).length() < 1e-9);
            let mut image = ImageF32::filled(camera.width, camera.height, 3, 0.0);
            for y in 0..camera.height {
                for x in 0..camera.width {
                    let ray = DVec3::new(
                        (x as f64 + 0.5 - camera.cx) / camera.fx,
                        (y as f64 + 0.5 - camera.cy) / camera.fy,
                        1.0,
                    );
                    let d = (pose.inverse().rotation * ray.normalize()).as_vec3();
                    image.pixel_mut(x, y).copy_from_slice(&d.to_array());
                }
            }
            Ok::<_, Infallible>(image)
        };
        let Ok(map) = map_of_faces(at, &orientation, 32, render);
        for (x, y) in [(0, 0), (20, 9), (40, 16), (63, 31), (11, 28)] {
            let expected = orientation.world_from_map(texel_direction(x, y, 64, 32)).as_vec3();
            let got = Vec3::from_slice(map.pixel(x, y));
            assert!(got.distance(expected) < 0.01, "{x} {y}: {got} {expected}");
        }
    }
}
