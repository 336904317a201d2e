//! Options of what the camera did to the photos.

use clap::Args;
use motes_scene::Switch;
use serde::{Deserialize, Serialize};

/// What the camera did to the photos.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct Options {
    /// Exposure and white balance of every photo; auto keeps them where photos differ by a tenth and both halves of the scene say
    /// the same
    #[arg(long, value_enum, default_value_t = Switch::Auto, value_name = "SWITCH", help_heading = "Model")]
    pub exposure: Switch,

    /// Tone curve of the camera, contrast beyond the sRGB curve: auto keeps it where exposures differ and dark, middle and bright points
    /// answer to them unequally without it; off takes photos as sRGB
    #[arg(long, value_enum, default_value_t = Switch::Off, value_name = "SWITCH", help_heading = "Model")]
    pub tone_curve: Switch,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
