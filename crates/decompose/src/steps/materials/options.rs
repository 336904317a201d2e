//! Options of the materials.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How parts and their materials are found.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rays per point and viewing direction for comparing materials; two thirds sample the light
    #[arg(long, default_value_t = 96, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub material_rays: u32,

    /// Label cost of one more material segment with a roughness of its own
    #[arg(long, default_value_t = 20.0, value_name = "PRICE", help_heading = "Priors (expert)")]
    pub weight_smooth_roughness: f32,

    /// Label cost of calling a material segment metal
    #[arg(long, default_value_t = 10.0, value_name = "PRICE", help_heading = "Priors (expert)")]
    pub weight_sparse_metal: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
