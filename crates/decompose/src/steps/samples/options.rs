//! Options of the choice of points.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How the points of the surface are chosen.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Surface points that light and material are fitted to
    #[arg(long, default_value_t = 8000, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub samples: usize,

    /// Photos that are looked at, per capture: of larger captures those that show most of the scene
    /// from most sides; 0 takes all
    #[arg(long, default_value_t = 60, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub most_photos: usize,

    /// Held-out photos that the result is compared with, evenly chosen; 0 takes all
    #[arg(long, default_value_t = 8, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub most_held_out: usize,

    /// Photos that each of those points is compared with at most, chosen by angle; 0 takes all
    #[arg(long, default_value_t = 24, value_name = "COUNT", help_heading = "Fit (expert)")]
    pub point_photos: usize,

    /// How far predicted normals (--prior-images) replace those of the surface, 0 to 1
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors (expert)")]
    pub weight_prior_normals: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
