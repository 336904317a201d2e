//! Options of shape from reflection.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How metals are turned to what they mirror.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rounds of shape from reflection, which turns the surface of metals to what they mirror; 0 leaves it as it was extracted
    #[arg(
        long,
        alias = "mirror-rounds",
        default_value_t = 1,
        value_name = "COUNT",
        help_heading = "Fit"
    )]
    pub shape_from_reflection_rounds: u32,

    /// Weight: normals of metals are smooth, where they are told by what is mirrored
    #[arg(long, default_value_t = 8.0, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_smooth_normals: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
