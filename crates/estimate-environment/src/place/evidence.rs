//! Points of surfaces with normals and colors, as the training views show them.
//!
//! Depth of a splat is noisy at single pixels, and nothing taught its Gaussians to lie flat. A normal is that of the plane through the
//! points of 5 x 5 pixels, where they lie on one.

use glam::{DVec3, Vec3};
use motes_math::rng::keyed_rng;
use motes_raster::{RenderOptions, render};
use motes_scene::{Pinhole, Pose};
use rand::RngExt as _;

use super::{CLIPPED, Splat, decoded, scale_of};

/// Views that are looked at, spread over the capture.
const VIEWS: usize = 16;
/// Longer side of their pictures, pixels.
const SIDE: usize = 160;
/// Half the side of the patch of a normal, pixels.
const REACH: usize = 2;
/// Largest distance of the patch's points from its plane over its width, root mean square.
const ROUGHNESS: f64 = 0.06;
/// Points that are kept.
const POINTS: usize = 2000;
/// Darker points are noise: encoded.
const DARK: f32 = 0.06;
/// Distances from the place beyond this many of the cameras' are another place.
const FAR: f64 = 2.0;
const STREAM: u64 = 0x00e5_71de;

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceSample {
    /// World.
    pub position: DVec3,
    /// Unit, world, toward the camera that saw it.
    pub normal: DVec3,
    /// Radiance that it sends to that camera, linear RGB.
    pub radiance: Vec3,
}

/// Points around `at`, at most a few thousand, neither clipped nor dark.
pub fn points(splat: &Splat<'_>, at: DVec3, seed: u64) -> Vec<SurfaceSample> {
    let stride = splat.views.len().div_ceil(VIEWS).max(1);
    let reach = FAR * scale_of(splat.views, at);
    let mut found = Vec::new();
    for (camera, pose) in splat.views.iter().step_by(stride) {
        let factor = (SIDE as f64 / camera.width.max(camera.height) as f64).min(1.0);
        let side = |n: usize| ((n as f64 * factor).round() as usize).max(1);
        let camera = camera.resized(side(camera.width), side(camera.height));
        of_view(splat, &camera, pose, &mut found);
    }
    found.retain(|p| p.position.distance(at) < reach);
    let mut random = keyed_rng(seed, STREAM, 0);
    let n = found.len();
    let count = POINTS.min(n);
    // The first `count` of a shuffle.
    for i in 0..count {
        let k = i + (random.random::<f64>() * (n - i) as f64) as usize;
        found.swap(i, k.min(n - 1));
    }
    found.truncate(count);
    found
}

fn of_view(splat: &Splat<'_>, camera: &Pinhole, pose: &Pose, found: &mut Vec<SurfaceSample>) {
    let options =
        RenderOptions { antialias: splat.antialias, aovs: true, ..RenderOptions::default() };
    let drawn = render(splat.gaussians, camera, pose, &options);
    let Some(aovs) = &drawn.aovs else { return };
    let world_from_camera = pose.inverse();
    let (w, h) = (camera.width, camera.height);
    let point = |x: usize, y: usize| {
        let depth = f64::from(aovs.depth_expected.pixel(x, y)[0]);
        let alpha = drawn.alpha.pixel(x, y)[0];
        let ray = DVec3::new(
            (x as f64 + 0.5 - camera.cx) / camera.fx,
            (y as f64 + 0.5 - camera.cy) / camera.fy,
            1.0,
        );
        (alpha > 0.9 && depth > 0.0).then(|| world_from_camera.transform_point(ray * depth))
    };
    let eye = world_from_camera.translation;
    for y in (REACH..h.saturating_sub(REACH)).step_by(2) {
        for x in (REACH..w.saturating_sub(REACH)).step_by(2) {
            let color = drawn.color.pixel(x, y);
            let brightest = color.iter().fold(0.0f32, |a, b| a.max(*b));
            if !(DARK..CLIPPED - 0.02).contains(&brightest) {
                continue;
            }
            let patch = (0..25).map(|k| point(x + k % 5 - REACH, y + k / 5 - REACH));
            let Some(patch) = patch.collect::<Option<Vec<DVec3>>>() else { continue };
            let Some(normal) = plane_normal(&patch) else { continue };
            let position = patch[12];
            let normal = if normal.dot(eye - position) < 0.0 { -normal } else { normal };
            // Grazing views see more of the splat's fuzz than of its surface.
            if normal.dot((eye - position).normalize()) > 0.2 {
                let alpha = drawn.alpha.pixel(x, y)[0];
                let encoded: Vec<f32> = color.iter().map(|v| v / alpha).collect();
                found.push(SurfaceSample { position, normal, radiance: decoded(&encoded) });
            }
        }
    }
}

/// Unit normal of the plane of points on a 5 x 5 grid; `None` where they lie on none.
fn plane_normal(patch: &[DVec3]) -> Option<DVec3> {
    let mean = patch.iter().copied().sum::<DVec3>() / patch.len() as f64;
    // Along a row and along a column, by least squares on the grid.
    let slope = |step: &dyn Fn(usize) -> f64| -> DVec3 {
        patch.iter().enumerate().map(|(k, p)| (*p - mean) * step(k)).sum::<DVec3>() / 50.0
    };
    let along = slope(&|k| (k % 5) as f64 - 2.0);
    let down = slope(&|k| (k / 5) as f64 - 2.0);
    let normal = along.cross(down).try_normalize()?;
    let width = 4.0 * along.length().max(down.length());
    let off = patch.iter().map(|p| (*p - mean).dot(normal).powi(2)).sum::<f64>();
    let off = (off / patch.len() as f64).sqrt();
    (off < ROUGHNESS * width).then_some(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_a_normal_and_a_step_has_none() {
        let at = |k: usize, z: f64| DVec3::new((k % 5) as f64, (k / 5) as f64, z);
        let flat: Vec<DVec3> = (0..25).map(|k| at(k, 0.3 * (k % 5) as f64)).collect();
        let normal = plane_normal(&flat).unwrap();
        assert!(normal.dot(DVec3::new(-0.3, 0.0, 1.0).normalize()).abs() > 0.9999);
        let step: Vec<DVec3> = (0..25).map(|k| at(k, if k % 5 > 2 { 3.0 } else { 0.0 })).collect();
        assert_eq!(plane_normal(&step), None);
    }
}
