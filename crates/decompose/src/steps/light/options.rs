//! Options of the light.

use clap::Args;
use motes_scene::Switch;
use serde::{Deserialize, Serialize};

use super::priors::WeightedPrior;

/// How the light is found from shading.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rays per side of a cell of the environment; finer cells take fewer
    #[arg(long, default_value_t = 2, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub light_rays: u32,

    /// Levels of subdivision of the environment where it is bright: 0 is smooth light only (11
    /// degrees), 3 resolves a sun (1.4 degrees)
    #[arg(long, default_value_t = 3, value_name = "LEVELS", help_heading = "Fit (expert)")]
    pub light_levels: u32,

    /// Lamps: pieces of the surface that the photos show clipped and that light what is around them;
    /// auto keeps those that do, off takes all light from infinity
    #[arg(long, value_enum, default_value_t = Switch::Auto, value_name = "SWITCH", help_heading = "Model")]
    pub lamps: Switch,

    /// Local light: irradiance that varies smoothly over the scene, as beside a lamp or a window; auto keeps it where
    /// neighbors have more alike base colors with it, off takes all light from infinity
    #[arg(long, value_enum, default_value_t = Switch::Auto, value_name = "SWITCH", help_heading = "Model")]
    pub local_light: Switch,

    /// Weight of the prior that neighboring points of similar chromaticity share a base color
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors (expert)")]
    pub weight_base_color: f32,

    /// Weight of the prior that the environment is piecewise smooth
    #[arg(long, default_value_t = 0.05, value_name = "WEIGHT", help_heading = "Priors (expert)")]
    pub weight_smooth_light: f32,

    /// Weight of the prior that the light is nearly white on average
    #[arg(long, default_value_t = 0.1, value_name = "WEIGHT", help_heading = "Priors (expert)")]
    pub weight_white_light: f32,

    /// Weight of differences in color between neighboring directions of the light, squared, relative to
    /// --weight-smooth-light
    #[arg(long, default_value_t = 3.0, value_name = "WEIGHT", help_heading = "Priors (expert)")]
    pub weight_light_color: f32,

    /// Priors of the light without a flag of their own; the help lists them
    #[arg(long = "light-prior", help = WeightedPrior::help(), value_name = "NAME=WEIGHT", help_heading = "Priors (expert)")]
    #[serde(rename = "light_prior", skip_serializing_if = "Vec::is_empty")]
    pub light_priors: Vec<WeightedPrior>,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
