//! Which model is drawn, and how it wants to be drawn.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::Serialize;

/// Where the Gaussians come from.
#[derive(Args, Clone, Debug, Default, Serialize)]
pub struct ModelInput {
    /// Gaussians (PLY)
    #[arg(long, value_name = "FILE", required_unless_present = "scene")]
    pub gaussians: Option<PathBuf>,

    /// Scene folder of decompose, relight or edit, rendered under its captured or last light
    #[arg(long, value_name = "DIR", conflicts_with = "gaussians")]
    pub scene: Option<PathBuf>,
}

/// Which pixel footprint Gaussians are drawn with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AntialiasChoice {
    /// As the PLY says, classic when it says nothing
    #[default]
    Auto,
    /// Dilate by 0.3 px², as INRIA-compatible viewers do
    Classic,
    /// Dilate and keep the energy (Mip-Splatting)
    Mip,
}

/// How bright a picture of a view of the capture is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ViewExposure {
    /// As the photo's metadata says, where the Gaussians were fitted so
    #[default]
    Metadata,
    /// As the Gaussians are
    Model,
}
