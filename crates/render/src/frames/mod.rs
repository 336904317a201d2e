//! From poses to picture files.

mod cryptomatte;
mod files;
mod look;
mod options;
mod plan;
mod report;
mod video;
mod write;

pub use cryptomatte::MatteObjects;
pub use files::{
    DepthRange, FrameFiles, FrameFormat, PictureFormat, PreviewAov, depth_range, exr_channels,
    preview,
};
pub use look::{Background, FrameLook, Projection, parse_background};
pub use options::{BetweenOptions, FrameSelection, FrameSize, SplitChoice};
pub use plan::{
    Frame, FrameSource, PlanError, numbered, pinhole_of, plan_frames, view_stems, views_of,
};
pub use report::RenderReport;
pub use video::{VideoOptions, ffmpeg_exists, run_ffmpeg, shell_words};
pub use write::{FrameWriter, path_frames};
