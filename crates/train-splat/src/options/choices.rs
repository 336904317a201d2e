//! Named alternatives of the fit.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Color behind the Gaussians while fitting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Background {
    /// Random at every step when photos have alpha, so that transparent parts stay transparent; else black.
    #[default]
    Auto,
    /// A new random color at every step.
    Random,
    /// Black.
    Black,
    /// White.
    White,
}

/// Which parameters a step of Adam changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AdamRule {
    /// All parameters: momentum continues where the views of a step see nothing.
    #[default]
    Dense,
    /// Parameters with a gradient; the others keep their moments (Taming 3DGS, Mallick et al.
    /// 2024).
    Visible,
}

/// Where Gaussians are added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Densify {
    /// Split Gaussians with a large gradient of the projected center (Kerbl et al. 2023).
    #[default]
    #[value(alias = "default")]
    Pull,
    /// Split Gaussians that cover most of the error of several views (after FastGS, 2025).
    Error,
    /// Move faint Gaussians to opaque ones and add noise to the centers (3DGS as Markov chain Monte
    /// Carlo, Kheradmand et al. 2024).
    #[value(alias = "mcmc")]
    Relocate,
}

/// Parameters that a fit may leave alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FreezeGroup {
    /// Centers, scales and rotations, and the number of Gaussians.
    Geometry,
    /// Centers, and the number of Gaussians.
    Means,
    /// Log scales.
    Scales,
    /// Quaternions.
    Rotations,
    /// Opacity logits.
    Opacities,
    /// All spherical harmonics.
    Colors,
}
