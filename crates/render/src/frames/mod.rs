//! From poses to picture files.

mod cryptomatte;
mod files;
mod look;
mod options;
mod plan;
mod report;
mod turntable;
mod video;

pub use cryptomatte::MatteObjects;
pub use files::{FrameFiles, depth_range, exr_channels, preview};
pub use options::{
    Background, BetweenOptions, DepthRange, FrameFormat, FrameLook, FrameSelection, FrameSize,
    PictureFormat, PreviewAov, Projection, VideoOptions, parse_background,
};
pub use plan::{
    Frame, FrameSource, PlanError, numbered, path_frames, pinhole_of, plan_frames, view_stems,
    views_of,
};
pub use report::RenderReport;
pub use turntable::turntable;
pub use video::{ffmpeg_exists, run_ffmpeg, shell_words};
