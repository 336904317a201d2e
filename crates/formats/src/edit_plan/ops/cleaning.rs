//! Operations that clean up, and the one that takes back.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::edit_plan::values::{BoxDocument, KeepDocument, OrderDocument, SphereDocument};

/// Keep one side of a region: exactly one of `box` and `sphere`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CropOp {
    /// A box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub r#box: Option<BoxDocument>,
    /// A ball.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sphere: Option<SphereDocument>,
    /// Which side stays.
    #[serde(default)]
    pub keep: KeepDocument,
}

/// Remove Gaussians that hang far from all others: statistical outlier removal (Rusu 2008).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RemoveFloatersOp {
    /// Among which.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Number of neighbors that are looked at.
    #[serde(default = "sixteen")]
    #[schemars(range(min = 1, max = 256))]
    #[serde(rename = "neighbours")]
    pub neighbors: u32,
    /// A Gaussian goes when the logarithm of its distance to its neighbors, less that of its own size where it is
    /// larger than usual, is so many standard deviations above the mean.
    #[serde(default = "three")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub deviations: f64,
}

impl Default for RemoveFloatersOp {
    fn default() -> Self {
        Self { target: None, neighbors: sixteen(), deviations: three() }
    }
}

/// Keep the largest cluster of Gaussians that touch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeepLargestOp {
    /// Among which; the others stay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Two Gaussians touch when their centers are closer than this many times the median distance to the nearest neighbors,
    /// or than their own larger radii.
    #[serde(default = "three")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reach: f64,
}

impl Default for KeepLargestOp {
    fn default() -> Self {
        Self { target: None, reach: three() }
    }
}

/// Remove Gaussians with values that are not numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DropNanOp {}

/// Merge neighbors until a number is left.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DecimateOp {
    /// Among which; the others stay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Gaussians of the target that are left.
    #[schemars(range(min = 1))]
    pub count: u64,
}

/// Sort.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OrderOp {
    /// Along what.
    #[serde(default)]
    pub by: OrderDocument,
}

/// Drop the bands of spherical harmonics above a degree.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShReduceOp {
    /// Highest degree that stays, 0 to 4.
    #[schemars(range(min = 0, max = 4))]
    pub degree: u8,
}

/// Take back operations before this one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UndoOp {
    /// How many.
    #[serde(default = "one")]
    #[schemars(range(min = 1, max = 10_000))]
    pub steps: u64,
}

impl Default for UndoOp {
    fn default() -> Self {
        Self { steps: 1 }
    }
}

fn one() -> u64 {
    1
}

fn sixteen() -> u32 {
    16
}

fn three() -> f64 {
    3.0
}
