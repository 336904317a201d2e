//! Whether the frames become a video.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

/// Numbered pictures and what becomes of them.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Video")]
pub struct VideoOptions {
    /// Number the images frame_0000, frame_0001, ... instead of naming them after views
    #[arg(long)]
    pub video_frames: bool,

    /// Encode the PNG files as a video with ffmpeg; implies --video-frames
    #[arg(long, value_name = "FILE")]
    pub video: Option<PathBuf>,

    /// Frames per second of the video
    #[arg(long, value_name = "N", default_value_t = 30,
        value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub fps: u32,
}
