//! Panoramas: six pinhole faces of a cube, resampled.
//!
//! Direction of pixel `(x, y)`: longitude `θ = 2π (x / w - ½)`, latitude `φ = π (½ - y / h)`,
//! `d = (cos φ sin θ, -sin φ, cos φ cos θ)` in the camera frame, the center column looks along +z
//! (COLMAP's EQUIRECTANGULAR model).

use glam::{DMat3, DQuat, DVec3};
use motes_scene::{Gaussians, ImageF32, Pinhole, Pose};

use crate::options::RenderOptions;
use crate::render::{Aovs, Rendering, render};

/// Faces overlap by this factor so that bilinear lookups never leave a face.
const FACE_TANGENT: f64 = 1.05;

/// Renders a full panorama around the camera center.
///
/// Depth AOVs hold the distance along the ray, since a panorama has no single z axis. Where faces
/// meet, the ordering of Gaussians may differ by a pixel, as z depth does.
pub fn render_equirectangular(
    gaussians: &Gaussians,
    camera_from_world: &Pose,
    width: usize,
    height: usize,
    options: &RenderOptions,
) -> Rendering {
    // One face pixel spans no more than one panorama pixel at the face center.
    let size = ((width as f64 / std::f64::consts::PI * FACE_TANGENT).ceil() as usize).max(8);
    let half = size as f64 / 2.0;
    let focal = half / FACE_TANGENT;
    let camera = Pinhole { fx: focal, fy: focal, cx: half, cy: half, width: size, height: size };
    let axes: [DMat3; 6] = face_axes();
    let faces: Vec<Rendering> = axes
        .iter()
        .map(|camera_from_face| {
            let face_from_camera = Pose {
                rotation: DQuat::from_mat3(camera_from_face).conjugate(),
                translation: DVec3::ZERO,
            };
            render(gaussians, &camera, &face_from_camera.compose(camera_from_world), options)
        })
        .collect();

    let mut out = Rendering {
        color: ImageF32::filled(width, height, 3, 0.0),
        alpha: ImageF32::filled(width, height, 1, 0.0),
        aovs: options.aovs.then(|| Aovs {
            depth_expected: ImageF32::filled(width, height, 1, 0.0),
            depth_median: ImageF32::filled(width, height, 1, 0.0),
            normal_in_world: ImageF32::filled(width, height, 3, 0.0),
        }),
    };
    for y in 0..height {
        for x in 0..width {
            let theta = std::f64::consts::TAU * ((x as f64 + 0.5) / width as f64 - 0.5);
            let phi = std::f64::consts::PI * (0.5 - (y as f64 + 0.5) / height as f64);
            let d = DVec3::new(phi.cos() * theta.sin(), -phi.sin(), phi.cos() * theta.cos());
            let face = (0..6)
                .max_by(|&a, &b| axes[a].col(2).dot(d).total_cmp(&axes[b].col(2).dot(d)))
                .unwrap_or(0);
            let q = axes[face].transpose() * d;
            let (u, v) = (focal * q.x / q.z + half, focal * q.y / q.z + half);
            let source = &faces[face];
            bilinear(&source.color, u, v, out.color.pixel_mut(x, y));
            bilinear(&source.alpha, u, v, out.alpha.pixel_mut(x, y));
            if let (Some(to), Some(from)) = (&mut out.aovs, &source.aovs) {
                // z to distance along the ray; nearest pixel: depths must not be blended.
                let (i, j) = ((u as usize).min(size - 1), (v as usize).min(size - 1));
                let stretch = (1.0 / q.z) as f32;
                to.depth_expected.pixel_mut(x, y)[0] = from.depth_expected.pixel(i, j)[0] * stretch;
                to.depth_median.pixel_mut(x, y)[0] = from.depth_median.pixel(i, j)[0] * stretch;
                to.normal_in_world
                    .pixel_mut(x, y)
                    .copy_from_slice(from.normal_in_world.pixel(i, j));
            }
        }
    }
    out
}

/// Camera axes of the faces as columns: +z, +x, -z, -x, up, down.
fn face_axes() -> [DMat3; 6] {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    [
        DMat3::from_cols(x, y, z),
        DMat3::from_cols(-z, y, x),
        DMat3::from_cols(-x, y, -z),
        DMat3::from_cols(z, y, -x),
        DMat3::from_cols(x, z, -y),
        DMat3::from_cols(x, -z, y),
    ]
}

fn bilinear(image: &ImageF32, u: f64, v: f64, out: &mut [f32]) {
    let at = |value: f64, size: usize| {
        let value = (value - 0.5).clamp(0.0, (size - 1) as f64);
        let first = (value as usize).min(size - 2);
        (first, (value - first as f64) as f32)
    };
    let ((i, s), (j, t)) = (at(u, image.width), at(v, image.height));
    for (c, out) in out.iter_mut().enumerate() {
        let p = |di: usize, dj: usize| image.pixel(i + di, j + dj)[c];
        let (top, bottom) = (p(0, 0) * (1.0 - s) + p(1, 0) * s, p(0, 1) * (1.0 - s) + p(1, 1) * s);
        *out = top * (1.0 - t) + bottom * t;
    }
}
