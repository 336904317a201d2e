//! Which starts a fit may take.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Where the first Gaussians come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StartFrom {
    /// The capture's points; without points, or when a fit from them fails, the photos; then random.
    #[default]
    Auto,
    /// The capture's points.
    #[value(alias = "sfm")]
    Points,
    /// Points found in the posed photos: triangulated keypoints, a dense search, silhouettes.
    Photos,
    /// Random places in the space that the cameras look at.
    Random,
}
