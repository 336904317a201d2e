//! Poses of the pictures.

use std::path::PathBuf;

use clap::Args;
use motes_formats::camera_path::read_camera_path;
use motes_formats::capture::read_capture;
use motes_scene::{Pinhole, Pose, View};
use motes_stage::{Context, OrBadInput as _, StageError};
use render::frames::{
    BetweenOptions, Frame, FrameSelection, FrameSize, VideoOptions, numbered, path_frames,
    plan_frames,
};
use serde::Serialize;

/// The flags that choose poses.
#[derive(Args, Clone, Debug, Serialize)]
pub struct PoseOptions {
    /// Which poses.
    #[command(flatten)]
    #[serde(flatten)]
    pub selection: FrameSelection,

    /// Details of `--between`.
    #[command(flatten)]
    #[serde(flatten)]
    pub between: BetweenOptions,

    /// Size of the pictures.
    #[command(flatten)]
    #[serde(flatten)]
    pub size: FrameSize,

    /// Rotate the light once around over N numbered images
    #[arg(long, value_name = "N", help_heading = "Light",
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub turntable: Option<u32>,
}

/// A pose and how far the light is turned in it, degrees.
pub(super) type LitFrame = (Frame, f64);

/// The frames of the flags; a turntable gives `N` frames along all poses.
///
/// # Errors
/// When nothing was chosen, or a file or view does not exist.
pub fn load_frames(
    source: &PoseOptions,
    video: &VideoOptions,
    capture: Option<&PathBuf>,
    context: &Context,
) -> anyhow::Result<Vec<(Frame, f64)>> {
    let mut frames = if let Some(path) = &source.selection.path {
        context.input("path", path)?;
        path_frames(&read_camera_path(path)?)
    } else {
        // clap waives `requires` for flags that exclude each other, so this is said here.
        if source.between.is_given() && source.selection.between.is_empty() {
            return Err(StageError::usage("--t and --frames belong to --between").into());
        }
        let Some(chosen) = source.selection.source(&source.between) else {
            return Err(StageError::usage("nothing to relight was chosen")
                .help("give --split, --view or another choice of poses, or an output NAME.ply")
                .into());
        };
        let Some(capture) = capture else {
            return Err(StageError::usage("pictures of a capture's views need --capture").into());
        };
        context.input("capture", capture)?;
        plan_frames(&read_capture(capture)?, &chosen).or_bad_input()?
    };
    frames.iter_mut().for_each(|frame| frame.camera = source.size.apply(&frame.camera));
    if video.numbers_frames() {
        frames.iter_mut().zip(0..).for_each(|(frame, i)| frame.name = numbered(i));
    }
    let Some(n) = source.turntable else {
        return Ok(frames.into_iter().map(|frame| (frame, 0.0)).collect());
    };
    let poses = frames.len();
    let turned = |i: usize| {
        let frame = Frame { name: numbered(i), ..frames[i * poses / n as usize].clone() };
        (frame, 360.0 * i as f64 / f64::from(n))
    };
    Ok((0..n as usize).map(turned).collect())
}

/// Cameras of the pictures that an exposure is metered in: those that are made, else those of the capture.
///
/// # Errors
/// When the capture cannot be read.
pub(super) fn metered_cameras(
    frames: &[LitFrame],
    capture: Option<&PathBuf>,
    context: &Context,
) -> anyhow::Result<Vec<(Pinhole, Pose)>> {
    if let (true, Some(path)) = (frames.is_empty(), capture) {
        context.input("capture", path)?;
        let capture = read_capture(path)?;
        let of = |view: &View| {
            Some((capture.cameras[view.camera].as_pinhole()?, view.camera_from_world))
        };
        return Ok(capture.views.iter().filter_map(of).collect());
    }
    // A turntable shows every pose under many turns: one of each.
    let unturned = frames.iter().filter(|(_, turn)| *turn == frames[0].1);
    Ok(unturned.map(|(frame, _)| (frame.camera, frame.camera_from_world)).collect())
}
