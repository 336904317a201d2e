//! Which files a frame becomes.

use clap::{Args, ValueEnum};
use serde::Serialize;

/// What is written of each frame.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Outputs")]
pub struct FrameFormat {
    /// PNG (8-bit sRGB), EXR (linear, with all AOVs), or both
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t = PictureFormat::Png)]
    pub format: PictureFormat,

    /// Also write a PNG preview of these AOVs, separated by commas
    #[arg(long, value_enum, value_name = "AOV", value_delimiter = ',')]
    pub aov: Vec<PreviewAov>,

    /// Depths at the ends of the color map of the depth preview, world units [default: percentiles
    /// of the first image]
    #[arg(long, value_name = "NEAR,FAR", value_parser = parse_depth_range)]
    pub depth_range: Option<DepthRange>,
}

/// File format of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PictureFormat {
    /// 8-bit sRGB
    Png,
    /// Linear color, alpha, depths and normals
    Exr,
    /// Both
    Both,
}

fn parse_depth_range(text: &str) -> Result<DepthRange, String> {
    let parts: Vec<f32> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match *parts.as_slice() {
        [near, far] if near.is_finite() && far.is_finite() && near < far => {
            Ok(DepthRange { near, far })
        }
        _ => Err("expected two numbers NEAR,FAR with NEAR < FAR".into()),
    }
}

/// A PNG that shows an AOV to people; measure on the EXR.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PreviewAov {
    /// Expected depth with a color map; near is bright
    Depth,
    /// World normal; -1 to 1 maps to 0 to 255 in R, G, B
    Normal,
    /// Alpha, 0 to 255
    Alpha,
}

/// Depths at the two ends of a preview's colors, world units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthRange {
    /// Brightest.
    pub near: f32,
    /// Darkest.
    pub far: f32,
}
