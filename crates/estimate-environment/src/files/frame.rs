//! Where the axes of a map are.

use glam::{DMat3, DVec3};
use motes_formats::capture::read_capture;
use motes_scene::camera_path::mean_up;
use motes_scene::{Capture, Convention, ImageF32, Pose};
use motes_shading::environment::{MapAxes, Orientation};
use motes_stage::{Context, StageError};

use super::arguments::Args;
use super::values::vector;
use crate::sphere::{look_up, texel_direction};

/// The capture of the command line.
pub(super) fn capture(args: &Args, context: &Context) -> anyhow::Result<Option<Capture>> {
    let Some(path) = &args.capture else { return Ok(None) };
    context.input("capture", path)?;
    Ok(Some(read_capture(path)?))
}

/// The pose of `--view`.
pub(super) fn pose_of_view(args: &Args, capture: Option<&Capture>) -> anyhow::Result<Option<Pose>> {
    let (Some(name), Some(capture)) = (&args.view, capture) else { return Ok(None) };
    Ok(Some(capture.views[view_named(capture, name)?].camera_from_world))
}

/// Index of a view.
pub(super) fn view_named(capture: &Capture, name: &str) -> anyhow::Result<usize> {
    let found =
        capture.view_named(name).ok_or_else(|| {
            let known: Vec<_> = capture.views.iter().take(4).map(|v| v.name.as_str()).collect();
            StageError::bad_input(format!("the capture has no view named \"{name}\"")).help(
                format!("the first of its {} views are {}", capture.views.len(), known.join(", ")),
            )
        });
    Ok(found?)
}

/// The direction away from the ground: `--up`, else what is known.
pub(super) fn up_of(args: &Args, capture: Option<&Capture>, of_scene: Option<DVec3>) -> DVec3 {
    if let Some(up) = args.up.as_ref().and_then(|text| vector(text).ok()) {
        return up;
    }
    let of_cameras = || {
        let poses: Vec<Pose> = capture?.views.iter().map(|v| v.camera_from_world).collect();
        mean_up(&poses)
    };
    of_scene.or_else(of_cameras).unwrap_or(args.convention.up())
}

/// The axes that the map is asked for in: those of the convention, turned so that up is up.
pub(super) fn axes_of(args: &Args, up_in_world: DVec3) -> MapAxes {
    MapAxes::upright(args.convention, up_in_world)
}

/// A map in the axes of a camera, `(-x, -y, z)`, turned into others. Without a pose the camera is level and the middle of the map, in
/// the convention's axes, is where it looks.
pub(super) fn turn(
    map: &ImageF32,
    weights: &[f32],
    camera_from_world: Option<&Pose>,
    to: &MapAxes,
) -> (ImageF32, Vec<f32>) {
    let flip = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
    let old_from_world = match camera_from_world {
        Some(pose) => flip * pose.rotation_matrix(),
        None => Orientation::new(to.convention).map_from_world,
    };
    let to = match camera_from_world {
        Some(_) => to.orientation(),
        None => Orientation::new(to.convention),
    };
    let (w, h) = (map.width, map.height);
    let weights = ImageF32::from_data(w, h, 1, weights.to_vec());
    let triple = |i: usize| [weights.data[i]; 3];
    let weights = ImageF32::from_data(w, h, 3, (0..w * h).flat_map(triple).collect());
    let mut out = (map.clone(), vec![0.0; w * h]);
    for i in 0..w * h {
        let world = to.world_from_map(texel_direction(i % w, i / w, w, h));
        let old = old_from_world * world;
        out.0.data[3 * i..3 * i + 3].copy_from_slice(&look_up(map, old).to_array());
        out.1[i] = look_up(&weights, old).x;
    }
    out
}

/// The axes of a map without a pose.
pub(super) fn axes_without_pose(convention: Convention) -> MapAxes {
    MapAxes::of_world(convention)
}
