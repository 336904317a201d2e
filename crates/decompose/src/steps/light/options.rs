//! Options of the light.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How the light is found from shading.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rays per side of a cell of the light; finer cells take fewer
    #[arg(long, default_value_t = 2, value_name = "COUNT", help_heading = "Fit")]
    pub light_rays: u32,

    /// How often cells of the light that matter are divided: 0 smooth light only (11 degrees), 3 a sun (1.4 degrees)
    #[arg(long, default_value_t = 3, value_name = "LEVELS", help_heading = "Fit")]
    pub light_levels: u32,

    /// Weight: neighboring points of like chromaticity have one base color
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_base_color: f32,

    /// Weight: the light is smooth, but for few edges
    #[arg(long, default_value_t = 0.05, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_smooth_light: f32,

    /// Weight: the light is nearly white, on the whole
    #[arg(long, default_value_t = 0.1, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_white_light: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
