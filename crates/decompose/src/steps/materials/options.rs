//! Options of the materials.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How parts and their materials are found.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rays per point and direction of view where materials are compared; two thirds toward the light
    #[arg(long, default_value_t = 96, value_name = "COUNT", help_heading = "Fit")]
    pub material_rays: u32,

    /// What one more part of a roughness of its own costs (smooth roughness)
    #[arg(long, default_value_t = 20.0, value_name = "PRICE", help_heading = "Priors")]
    pub weight_smooth_roughness: f32,

    /// What calling a part metal costs (sparse metal)
    #[arg(long, default_value_t = 10.0, value_name = "PRICE", help_heading = "Priors")]
    pub weight_sparse_metal: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
