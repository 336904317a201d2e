//! Options of the refinement of the Gaussians.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How Gaussians are fitted to the photos through the shading.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Steps, one photo each, that refine shapes, opacities and base colors of the Gaussians
    /// through the fitted shading, and the captured colors with them; 0 leaves shapes and captured
    /// colors unchanged
    #[arg(long, default_value_t = 600, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub photo_steps: u32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
