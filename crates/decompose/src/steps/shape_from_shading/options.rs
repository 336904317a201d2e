//! Options of shape from shading.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How the surface is moved by its shading.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rounds of shape from shading, which moves the surface of what is not metal; 0 leaves it as it was extracted
    #[arg(
        long,
        alias = "relief-rounds",
        default_value_t = 3,
        value_name = "COUNT",
        help_heading = "Fit"
    )]
    pub shape_from_shading_rounds: u32,

    /// Weight: the displacement by shape from shading is smooth
    #[arg(
        long,
        alias = "weight-smooth-relief",
        default_value_t = 5.0,
        value_name = "WEIGHT",
        help_heading = "Priors"
    )]
    pub weight_smooth_displacement: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
