//! Options of shape from reflection.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How metals are turned to what they mirror.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rounds of shape from reflection, which corrects normals of metallic surfaces; 0 keeps the
    /// extracted surface
    #[arg(
        long,
        alias = "mirror-rounds",
        default_value_t = 1,
        value_name = "COUNT",
        help_heading = "Fit (expert)"
    )]
    pub shape_from_reflection_rounds: u32,

    /// Weight of the prior that normals from reflection are smooth
    #[arg(long, default_value_t = 8.0, value_name = "WEIGHT", help_heading = "Priors (expert)")]
    pub weight_smooth_normals: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
