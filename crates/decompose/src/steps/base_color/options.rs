//! Options of the base colors.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How base colors get into the Gaussians.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Passes over the photos that transfer base colors to the Gaussians
    #[arg(long, default_value_t = 12, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub color_passes: u32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
