//! Options of light from reflections.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How the light is fitted to what is reflected.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Rounds that refine the light from reflections on glossy and metallic surfaces, while
    /// materials then explain the photos better; 0 keeps the light from shading
    #[arg(long, default_value_t = 2, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub reflected_light_rounds: u32,

    /// Weight of those reflections (--reflected-light-rounds)
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors (expert)")]
    pub weight_reflected_light: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
