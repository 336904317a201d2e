//! Pictures of a state.

use glam::{DQuat, DVec3};
use motes_math::median::quantile;
use motes_raster::{Antialias, RenderOptions, render};
use motes_scene::{Gaussians, ImageU8, Pinhole, Pose};

use crate::EditState;
use crate::changes::measure::Extent;

/// A picture and the name of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Preview {
    /// Name, ends in `.png`.
    pub file: String,
    /// 8-bit sRGB.
    pub image: ImageU8,
}

/// Half the vertical angle of view.
const HALF_FOV_DEG: f64 = 22.5;
/// Room around the target.
const MARGIN: f64 = 1.2;

/// A camera that sees a target from `azimuth_deg` about up and `elevation_deg` above the horizon; pictures are 4 : 3.
pub fn orbit_camera(
    extent: &Extent,
    azimuth_deg: f64,
    elevation_deg: f64,
    size: usize,
) -> Option<(Pinhole, Pose)> {
    let up = extent.up;
    let level = up.any_orthonormal_vector();
    let (azimuth, elevation) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    let outward = DQuat::from_axis_angle(up, azimuth) * level;
    let direction = outward * elevation.cos() + up * elevation.sin();
    let center =
        extent.centroid + up * (0.5 * (extent.top + extent.bottom) - extent.centroid.dot(up));
    let reach = (0.5 * extent.height()).hypot(0.5 * extent.footprint());
    let distance = MARGIN * reach / HALF_FOV_DEG.to_radians().sin();
    let pose = Pose::look_at(center + direction * distance, center, up)?;
    let (width, height) = (size.max(4), (size * 3 / 4).max(3));
    let focal = 0.5 * height as f64 / HALF_FOV_DEG.to_radians().tan();
    let (cx, cy) = (0.5 * width as f64, 0.5 * height as f64);
    Some((Pinhole { fx: focal, fy: focal, cx, cy, width, height }, pose))
}

/// A picture of the Gaussians with the tone curve of the photos, as `relight` shows a scene; black where nothing is.
pub fn picture(state: &EditState, antialias: Antialias, camera: &Pinhole, pose: &Pose) -> ImageU8 {
    let options = RenderOptions { antialias, ..RenderOptions::default() };
    let mut color = render(&state.gaussians, camera, pose, &options).color;
    let curve = state.tone_curve();
    color.data.iter_mut().for_each(|v| *v = curve.apply(*v));
    color.to_u8()
}

/// Where most of the opacity is: the extent of the middle 90 percent along every axis, so that a far background does not push
/// the camera away.
pub fn whole_extent(gaussians: &Gaussians, up: DVec3) -> Option<Extent> {
    let mut bounds = [(0.0f32, 0.0f32); 3];
    for (axis, bound) in bounds.iter_mut().enumerate() {
        let mut values: Vec<f32> =
            gaussians.means.iter().map(|m| m[axis]).filter(|v| v.is_finite()).collect();
        *bound = (quantile(&mut values, 0.05)?, quantile(&mut values, 0.95)?);
    }
    let inside = |row: &u32| {
        let m = gaussians.means[*row as usize];
        (0..3).all(|k| (bounds[k].0..=bounds[k].1).contains(&m[k]))
    };
    let rows: Vec<u32> = (0..gaussians.len() as u32).filter(inside).collect();
    Extent::of(gaussians, &rows, up)
}
