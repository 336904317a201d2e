//! Options of shape from shading.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How the surface is moved by its shading.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rounds of shape from shading, which displaces non-metallic surfaces; 0 keeps the extracted
    /// surface
    #[arg(
        long,
        alias = "relief-rounds",
        default_value_t = 3,
        value_name = "COUNT",
        help_heading = "Fit (expert)"
    )]
    pub shape_from_shading_rounds: u32,

    /// Weight of the prior that displacements from shading are smooth
    #[arg(
        long,
        alias = "weight-smooth-relief",
        default_value_t = 5.0,
        value_name = "WEIGHT",
        help_heading = "Priors (expert)"
    )]
    pub weight_smooth_displacement: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
