//! What a user may ask of model selection.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// How much of the model is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelChoice {
    /// What held-out evidence supports, component by component.
    #[default]
    Auto,
    /// Everything: SH degree 3, affine exposures, a far shell, every stage; nothing is pruned at the end.
    Full,
    /// Nothing optional: SH degree 0, no exposures, no background.
    Minimal,
}

/// What differs between photos of the same light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExposureModel {
    /// Decided from the capture; the report says how.
    #[default]
    Auto,
    /// Nothing.
    #[value(alias = "off")]
    #[serde(alias = "off")]
    None,
    /// A gain per photo and channel.
    Gain,
    /// A gain and an offset per photo and channel.
    #[value(alias = "on")]
    #[serde(alias = "on")]
    Affine,
}

/// What lies behind everything that the points describe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BackgroundModel {
    /// Nothing.
    #[default]
    None,
    /// One learned color.
    Color,
    /// Gaussians on a far sphere, in the directions that no point covers.
    Shell,
}
