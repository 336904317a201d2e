//! Options of the appearance residual.

use clap::Args;
use relight::Quality;
use serde::{Deserialize, Serialize};

/// How the appearance residual is fitted.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Steps, one photo each, that fit the appearance residual: a view-dependent factor per
    /// Gaussian for what the model leaves unexplained; 0 disables it
    #[arg(long, default_value_t = 200, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub residual_steps: u32,

    /// Degree of the spherical harmonics of the appearance residual
    #[arg(long, default_value_t = 3, value_name = "DEGREE", help_heading = "Fit (expert)",
        value_parser = clap::value_parser!(u8).range(0..=4))]
    pub residual_degree: u8,

    /// Quality of the pictures of the model that the appearance residual is fitted to, as `relight` makes them
    #[arg(long, value_enum, default_value_t = Quality::Preview, value_name = "QUALITY", help_heading = "Fit (expert)")]
    pub residual_quality: Quality,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
