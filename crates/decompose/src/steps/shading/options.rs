//! Options of the shading of pixels.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How the shading of every pixel is integrated.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rays per pixel of the photos for estimating base color
    #[arg(long, default_value_t = 48, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub pixel_rays: u32,

    /// Pixels from one whose shading is integrated to the next, where it is smooth; between them it
    /// is interpolated. 1 integrates every pixel
    #[arg(long, default_value_t = 4, value_name = "PIXELS", help_heading = "Fit (expert)",
        value_parser = clap::value_parser!(u8).range(1..=64))]
    pub pixel_spacing: u8,

    /// Where interpolated shading counts as smooth (--pixel-spacing): by what share of its brightness,
    /// and by what angle of the normals in radians, it may be off
    #[arg(long, default_value_t = 0.1, value_name = "SHARE", help_heading = "Fit (expert)")]
    pub pixel_tolerance: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
