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
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
