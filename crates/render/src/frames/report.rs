//! What the stage `render` says when it is done.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

/// What was rendered.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RenderReport {
    /// Number of poses.
    pub pictures: usize,
    /// Number of Gaussians of the model.
    pub gaussians: usize,
    /// The folder.
    pub output: PathBuf,
    /// Mean wall-clock seconds, writing included.
    pub seconds_per_picture: f64,
    /// Mean CPU seconds of all threads, writing left out; null where the system does not tell.
    pub cpu_seconds_per_picture: Option<f64>,
    /// Makes a video of numbered pictures.
    pub video_command: Option<String>,
}

impl fmt::Display for RenderReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (pictures, gaussians) = (self.pictures, self.gaussians);
        let (seconds, folder) = (self.seconds_per_picture, self.output.display());
        let s = if pictures == 1 { "" } else { "s" };
        writeln!(
            f,
            "{pictures} picture{s} of {gaussians} Gaussians, {seconds:.2} s each: {folder}"
        )?;
        let Some(command) = &self.video_command else { return Ok(()) };
        writeln!(f, "to make a video: {command}")
    }
}
