//! Which pictures `render` makes.

use std::path::Path;

use crate::frames::{
    BetweenOptions, Frame, FrameSelection, FrameSize, VideoOptions, numbered, path_frames,
    plan_frames,
};
use motes_formats::camera_path::read_camera_path;
use motes_formats::capture::read_capture;
use motes_stage::{Context, OrBadInput as _, StageError};

/// What the flags say about frames.
#[derive(Clone, Copy, Debug)]
pub struct ChosenFrames<'a> {
    /// Gives cameras and poses.
    pub capture: Option<&'a Path>,
    /// Views, or a path.
    pub selection: &'a FrameSelection,
    /// Poses between views.
    pub between: &'a BetweenOptions,
    /// Of the pictures.
    pub size: &'a FrameSize,
    /// Frames of a video are numbered.
    pub video: &'a VideoOptions,
}

impl ChosenFrames<'_> {
    /// The frames, with their cameras at the size asked for.
    ///
    /// # Errors
    /// When nothing was chosen, flags do not fit together, or a file is missing or malformed.
    pub fn load(&self, context: &Context) -> anyhow::Result<Vec<Frame>> {
        let mut frames = if let Some(path) = &self.selection.path {
            context.input("path", path)?;
            path_frames(&read_camera_path(path)?)
        } else {
            // clap waives `requires` for flags that exclude each other, so this is said here.
            if self.between.is_given() && self.selection.between.is_empty() {
                return Err(StageError::usage("--t and --frames belong to --between").into());
            }
            let source = self.selection.source(self.between);
            let (Some(capture), Some(source)) = (self.capture, source) else {
                return Err(StageError::usage("nothing to render was chosen").into());
            };
            context.input("capture", capture)?;
            plan_frames(&read_capture(capture)?, &source).or_bad_input()?
        };
        for (i, frame) in frames.iter_mut().enumerate() {
            frame.camera = self.size.apply(&frame.camera);
            if self.video.numbers_frames() {
                frame.name = numbered(i);
            }
        }
        Ok(frames)
    }
}
