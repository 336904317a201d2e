//! Pictures of a mirror ball.

use std::path::Path;

use glam::Vec3;
use motes_math::srgb;
use motes_stage::{Context, StageError};

use super::arguments::{Args, Estimate};
use super::brackets::linear_picture;
use super::frame::{axes_of, axes_without_pose, capture, pose_of_view, turn, up_of};
use super::report::BallReport;
use super::values::{circle, rgb};
use crate::fill::fill;
use crate::mirror_ball::{find_ball, unwrap};
use crate::sphere::texel_solid_angle;

/// The light of `--mirror-ball`.
pub(super) fn of_ball(args: &Args, path: &Path, context: &Context) -> anyhow::Result<Estimate> {
    let capture = capture(args, context)?;
    let pose = pose_of_view(args, capture.as_ref())?;
    let picture = linear_picture(args, path, "mirror-ball", context)?;
    let given = args.ball.as_ref().and_then(|text| circle(text).ok());
    let outline = match given {
        Some(outline) => outline,
        None => {
            let mut encoded = picture.image.clone();
            encoded.data.iter_mut().for_each(|v| *v = srgb::encode(v.clamp(0.0, 1.0)));
            find_ball(&encoded).ok_or_else(|| {
                let text = format!("no ball stands out of the picture: {}", path.display());
                StageError::bad_input(text).help("say where it is with --ball CX,CY,R, pixels")
            })?
        }
    };
    let (w, h) = (picture.image.width as f64, picture.image.height as f64);
    let [x, y] = outline.center;
    if !((0.0..w).contains(&x) && (0.0..h).contains(&y) && outline.radius < w.max(h)) {
        let text = format!("--ball: {x},{y},{} does not lie in {w}x{h} pixels", outline.radius);
        return Err(StageError::bad_input(text).into());
    }
    context.stop_if_dry_run()?;
    let reflectance = rgb(&args.ball_reflectance).unwrap_or(Vec3::ONE);
    let distance = args.ball_distance.unwrap_or(f64::INFINITY);
    let is_clipped = |i: usize| picture.clipped[i];
    let out = unwrap(&picture.image, &outline, distance, reflectance, args.rows, &is_clipped);
    let axes = match &pose {
        Some(_) => axes_of(args, up_of(args, capture.as_ref(), None)),
        None => axes_without_pose(args.convention),
    };
    let (columns, rows) = (2 * args.rows, args.rows);
    let share = |of: &dyn Fn(usize) -> f64| {
        let texel = |i: usize| texel_solid_angle(i / columns, columns, rows) * of(i);
        (0..columns * rows).map(texel).sum::<f64>() / (4.0 * std::f64::consts::PI)
    };
    let filled = fill(&out.radiance, &out.seen);
    let (map, _) = turn(&filled, &out.seen, pose.as_ref(), &axes);
    Ok(Estimate {
        coverage: share(&|i| f64::from(out.seen[i])),
        clipped_share: share(&|i| f64::from(u8::from(out.clipped[i]))),
        brackets: picture.series,
        ball: Some(BallReport::of(&outline, given.is_none())),
        ..Estimate::new("mirror-ball", map, axes)
    })
}
