//! From photos or foreign models to a posed, undistorted capture.
//!
//! [`import`] gathers posed photos from one of three sources (a COLMAP model, a
//! `transforms.json`, or photos whose poses structure from motion finds), decides the split and
//! the world origin, resamples every photo and mask to a pinhole camera, and writes
//! `capture.json` with `images/`, `masks/` and the start points. [`ImportReport`] says in
//! numbers and sentences how far the poses can be trusted.

mod error;
mod exposure_response;
pub mod files;
mod gathered;
mod geometry;
mod options;
mod origin;
mod panorama;
mod plan;
mod progress;
mod report;
mod undistort;
mod video;
mod vignetting;
mod warp;

pub use error::{IngestError, Result};
pub use files::import::{import, import_photos, import_video};
pub use files::sfm::{CameraSharing, Keypoints, Matcher, SfmOptions, SfmReport, SfmTool};
pub use files::source::{ImportInput, Source};
pub use files::video::{VideoOptions, VideoReport};
pub use options::ImportOptions;
pub use progress::{Progress, Silent};
pub use report::ImportReport;
