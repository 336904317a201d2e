//! Pictures of a state.

use glam::{DQuat, DVec3};
use motes_formats::edit_plan::RenderOp;
use motes_math::median::quantile;
use motes_raster::{Antialias, RenderOptions, render};
use motes_scene::{Gaussians, ImageU8, Pinhole, Pose};

use super::EditError;
use super::apply::{Outcome, Run, applied};
use super::values::{extent_of, rows_of};
use crate::EditState;
use crate::ops::measure::Extent;

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

/// A picture of Gaussians, black where nothing is.
pub fn picture(
    gaussians: &Gaussians,
    antialias: Antialias,
    camera: &Pinhole,
    pose: &Pose,
) -> ImageU8 {
    let options = RenderOptions { antialias, ..RenderOptions::default() };
    render(gaussians, camera, pose, &options).color.to_u8()
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

impl Run<'_> {
    /// The operation `render`.
    pub(super) fn render(
        &mut self,
        op: &RenderOp,
        state: &EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let size = op.size as usize;
        let camera = match (&op.view, self.resources.capture) {
            (Some(_), None) => {
                let cause = "a view of a capture needs a capture";
                return Err(EditError::plan(format!("{at}/view"), cause).remedy("give --capture"));
            }
            (Some(name), Some((capture, _))) => {
                let stem = |n: &str| n.rsplit_once('.').map_or(n.to_owned(), |(s, _)| s.to_owned());
                let found =
                    capture.views.iter().find(|v| v.name == *name || stem(&v.name) == *name);
                let view = found.ok_or_else(|| {
                    EditError::plan(format!("{at}/view"), format!("there is no view \"{name}\""))
                })?;
                let full = capture.cameras[view.camera].as_pinhole().ok_or_else(|| {
                    EditError::plan(
                        format!("{at}/view"),
                        "the camera of this view is not a pinhole",
                    )
                })?;
                let factor = size as f64 / full.width.max(full.height) as f64;
                let side = |n: usize| ((n as f64 * factor).round() as usize).max(1);
                (full.resized(side(full.width), side(full.height)), view.camera_from_world)
            }
            (None, _) => {
                let extent = match (&op.target, &state.current) {
                    (None, None) => whole_extent(&state.gaussians, state.up_in_world),
                    (target, _) => {
                        let rows = rows_of(state, target.as_deref(), at)?;
                        Some(extent_of(state, &rows, at)?)
                    }
                };
                extent
                    .and_then(|e| orbit_camera(&e, op.azimuth_deg, op.elevation_deg, size))
                    .ok_or_else(|| EditError::plan(at, "there is nothing to look at"))?
            }
        };
        let image = picture(&state.gaussians, self.resources.antialias, &camera.0, &camera.1);
        let number = self.previews.len();
        let file = op.file.clone().unwrap_or_else(|| format!("preview-{number:03}.png"));
        let plain = !file.contains(['/', '\\']) && file.to_ascii_lowercase().ends_with(".png");
        if !plain || self.previews.iter().any(|p| p.file == file) {
            let cause = format!("\"{file}\" is not the name of a new PNG file without folders");
            return Err(EditError::plan(format!("{at}/file"), cause));
        }
        self.previews.push(Preview { file, image });
        applied(state.len())
    }
}
