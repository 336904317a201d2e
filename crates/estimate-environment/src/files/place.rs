//! A splat seen from a point.

use std::path::Path;

use glam::DVec3;
use motes_codecs::open_gaussians;
use motes_formats::ply::RenderMode;
use motes_raster::{Antialias, RenderOptions, render};
use motes_scene::{Capture, Gaussians};
use motes_stage::{Context, StageError};

use super::arguments::{Args, Estimate};
use super::frame::{axes_of, up_of, view_named};
use super::values::At;
use crate::place::{PlaceOptions, Splat, estimate, scale_of, training_views};

/// How far above a surface a point is put that a pixel shows, over the distance of the cameras.
const ABOVE_SURFACE: f64 = 0.05;

/// The light at `--at` of a splat with its capture.
pub(super) fn of_splat(
    args: &Args,
    path: &Path,
    capture: &Capture,
    context: &Context,
) -> anyhow::Result<Estimate> {
    context.input("gaussians", path)?;
    let file = open_gaussians(path)?;
    let antialias = match file.render_mode {
        Some(RenderMode::Mip) => Antialias::Mip,
        _ => Antialias::Classic,
    };
    let views = training_views(capture);
    if views.is_empty() {
        let text = "the capture has no training view with a pinhole camera";
        return Err(StageError::bad_input(text)
            .help("import the photos with import-colmap, which undistorts them")
            .into());
    }
    let up = up_of(args, Some(capture), None);
    let at = point(args, capture, &file.gaussians, antialias, up)?;
    let lifted = at + up * args.lift.unwrap_or(0.0);
    context.stop_if_dry_run()?;
    let splat = Splat { gaussians: &file.gaussians, antialias, views: &views, up_in_world: up };
    let options = PlaceOptions {
        rows: args.rows,
        near: args.near,
        recover: !args.keep_clipped,
        seed: args.seed,
    };
    let axes = axes_of(args, up);
    let found = estimate(&splat, lifted, axes, &options);
    if found.report.coverage < 0.02 {
        context
            .warn("the Gaussians cover next to nothing around this point: is it inside the scene?");
    }
    Ok(Estimate {
        coverage: found.report.coverage,
        clipped_share: found.report.clipped_share,
        clipped_factor: found.report.clipped_factor,
        at: Some(lifted.to_array()),
        place: Some(found.report),
        ..Estimate::new("place", found.map, axes)
    })
}

/// The point of `--at`.
fn point(
    args: &Args,
    capture: &Capture,
    gaussians: &Gaussians,
    antialias: Antialias,
    up: DVec3,
) -> anyhow::Result<DVec3> {
    let (name, [x, y]) = match &args.at {
        Some(At::Point(point)) => return Ok(*point),
        Some(At::Pixel(name, pixel)) => (name, *pixel),
        None => anyhow::bail!("no point"),
    };
    let view = &capture.views[view_named(capture, name)?];
    let camera = capture.cameras[view.camera].as_pinhole().ok_or_else(|| {
        StageError::bad_input(format!("the camera of view \"{name}\" is not a pinhole"))
    })?;
    if !((0.0..camera.width as f64).contains(&x) && (0.0..camera.height as f64).contains(&y)) {
        let size = format!("{}x{}", camera.width, camera.height);
        let text = format!("--at: pixel {x},{y} is outside view \"{name}\", which has {size}");
        return Err(StageError::bad_input(text).into());
    }
    let pose = &view.camera_from_world;
    let options = RenderOptions { antialias, aovs: true, ..RenderOptions::default() };
    let aovs = render(gaussians, &camera, pose, &options).aovs;
    let depth = aovs.map_or(0.0, |a| f64::from(a.depth_median.pixel(x as usize, y as usize)[0]));
    if !(depth > 0.0) {
        let text = format!("--at: there is nothing at pixel {x},{y} of view \"{name}\"");
        return Err(StageError::bad_input(text).help("name a pixel that shows a surface").into());
    }
    let ray = DVec3::new((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
    let shown = pose.inverse().transform_point(ray * depth);
    // A point in a surface sees its own Gaussians.
    let above = match args.lift {
        Some(_) => 0.0,
        None => ABOVE_SURFACE * scale_of(&training_views(capture), shown),
    };
    Ok(shown + up * above)
}
