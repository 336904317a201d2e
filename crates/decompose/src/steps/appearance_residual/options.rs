//! Options of the appearance residual.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How the appearance residual is fitted.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Steps, one photo each, that put what the model leaves unexplained onto the Gaussians, as a factor that depends on the
    /// direction of view. 0 leaves it out
    #[arg(long, default_value_t = 400, value_name = "COUNT", help_heading = "Fit")]
    pub residual_steps: u32,

    /// Degree of the spherical harmonics of that factor
    #[arg(long, default_value_t = 3, value_name = "DEGREE", help_heading = "Fit",
        value_parser = clap::value_parser!(u8).range(0..=4))]
    pub residual_degree: u8,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
