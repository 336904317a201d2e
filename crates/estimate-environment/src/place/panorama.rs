//! What a splat shows around a point.

use glam::{DMat3, DQuat, DVec3};
use motes_raster::{RenderOptions, render_equirectangular};
use motes_scene::{Gaussians, ImageF32, Pinhole, Pose};
use motes_shading::environment::MapAxes;

use super::lights::CLIPPED;
use super::{Splat, decoded};
use crate::sphere::texel_direction;

/// Coverage below which a texel counts as not seen, and from which it is wholly seen.
const COVERED: (f32, f32) = (0.3, 0.9);
/// A point within this many standard deviations of a Gaussian is in it.
const WITHIN: f64 = 3.0;

/// A panorama of a splat.
#[derive(Clone, Debug)]
pub struct Panorama {
    /// Linear RGB, the background divided out.
    pub radiance: ImageF32,
    /// How far each texel is known, 0 to 1.
    pub covered: Vec<f32>,
    /// Whether a texel is as bright as a photo can be.
    pub clipped: Vec<bool>,
    /// Distance of what it shows, world units; 0 where nothing.
    pub distance: Vec<f32>,
}

/// Renders the Gaussians around `at`. A direction is covered where they are dense and some training view looks at what they show:
/// elsewhere a splat holds what no photo contradicted.
pub fn look_around(
    splat: &Splat<'_>,
    at: DVec3,
    axes: MapAxes,
    rows: usize,
    near: f64,
) -> Panorama {
    let orientation = axes.orientation();
    // The camera's x points to the left of the map and its y down: the same picture in either axes.
    let flip = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
    let rotation = DQuat::from_mat3(&(flip * orientation.map_from_world)).normalize();
    let pose = Pose { rotation, translation: -(rotation * at) };
    let options =
        RenderOptions { antialias: splat.antialias, aovs: true, ..RenderOptions::default() };
    let (w, h) = (2 * rows, rows);
    let around = without_what_holds(splat.gaussians, at, near);
    let drawn = render_equirectangular(&around, &pose, w, h, &options);
    let mut out = Panorama {
        radiance: ImageF32::filled(w, h, 3, 0.0),
        covered: vec![0.0; w * h],
        clipped: vec![false; w * h],
        distance: vec![0.0; w * h],
    };
    for i in 0..w * h {
        let alpha = drawn.alpha.data[i];
        let t = ((alpha - COVERED.0) / (COVERED.1 - COVERED.0)).clamp(0.0, 1.0);
        let distance = drawn.aovs.as_ref().map_or(0.0, |a| a.depth_median.data[i]);
        if !(t > 0.0 && distance > 0.0) {
            continue;
        }
        let direction = orientation.world_from_map(texel_direction(i % w, i / w, w, h));
        let point = at + direction * f64::from(distance);
        if !splat.views.iter().any(|view| is_in_view(view, point)) {
            continue;
        }
        let encoded: Vec<f32> =
            drawn.color.data[3 * i..3 * i + 3].iter().map(|v| v / alpha).collect();
        out.clipped[i] = alpha > COVERED.1 && encoded.iter().any(|v| *v >= CLIPPED);
        out.radiance.data[3 * i..3 * i + 3].copy_from_slice(&decoded(&encoded).to_array());
        out.covered[i] = t;
        out.distance[i] = distance;
    }
    out
}

/// The Gaussians but for those that the point is in, or whose centers are nearer than `near`: fuzz of what is there fills half of the
/// view, and photos never saw it from inside.
fn without_what_holds(gaussians: &Gaussians, at: DVec3, near: f64) -> Gaussians {
    let is_around = |row: &u32| {
        let row = *row as usize;
        let off = at - DVec3::from_array(gaussians.means[row].map(f64::from));
        let [w, x, y, z] = gaussians.rotations[row].map(f64::from);
        let own = DQuat::from_xyzw(x, y, z, w).normalize().conjugate() * off;
        let scales = DVec3::from_array(gaussians.log_scales[row].map(|s| f64::from(s).exp()));
        off.length() >= near && (own / scales).length() >= WITHIN
    };
    let rows: Vec<u32> = (0..gaussians.len() as u32).filter(is_around).collect();
    let mut around = gaussians.clone();
    around.gather(&rows);
    around
}

fn is_in_view((camera, camera_from_world): &(Pinhole, Pose), point: DVec3) -> bool {
    let p = camera_from_world.transform_point(point);
    let (u, v) = (camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy);
    p.z > 0.0
        && (0.0..=camera.width as f64).contains(&u)
        && (0.0..=camera.height as f64).contains(&v)
}
