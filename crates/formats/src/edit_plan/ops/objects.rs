//! Operations on matter: what is there, and where.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::edit_plan::values::{
    AlignDocument, AxisAngleDocument, Fill, FitDocument, PivotDocument,
};
use crate::selectors::SelectStep;

/// Choose Gaussians, and give the choice a name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SelectOp {
    /// Name for later operations. Without one the choice can be used until the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// The selection that the steps start from. Default: the one made last, none before the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// What `segment-select` takes: selectors (`by`), each combined with what was chosen before it (`combine`: `set`,
    /// `add`, `subtract`, `intersect`), and changes of the choice (`post`).
    #[schemars(length(min = 1))]
    pub steps: Vec<SelectStep>,
}

/// Move, rotate and scale about a pivot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransformOp {
    /// What to move.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// World units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translate: Option<[f64; 3]>,
    /// Rotation about an axis. At most one rotation per operation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate_axis: Option<AxisAngleDocument>,
    /// Degrees about the world's x, then y, then z axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate_euler_deg: Option<[f64; 3]>,
    /// Quaternion `w, x, y, z` of any length above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate_quaternion: Option<[f64; 4]>,
    /// Uniform factor above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// What rotation and scale leave in place: `origin`, `centroid` (default), `base` or `[x, y, z]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pivot: Option<PivotDocument>,
    /// What fills the place that the target leaves; the plane it stood on when nothing is said.
    #[serde(default)]
    pub fill: Fill,
}

/// Copy, each copy shifted by a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DuplicateOp {
    /// What to copy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Name of the selection of all copies.
    #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Shift from one copy to the next, world units.
    pub translate: [f64; 3],
    /// Number of copies.
    #[serde(default = "one")]
    #[schemars(range(min = 1, max = 10_000))]
    pub count: u64,
}

/// Take away, and fill what becomes visible.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DeleteOp {
    /// What goes: a selection, never left out before the first selection.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// What fills the place; the plane it stood on when nothing is said.
    #[serde(default)]
    pub fill: Fill,
}

/// Keep the target alone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExtractOp {
    /// What stays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

/// Add another splat, scene folder or mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InsertOp {
    /// A splat (PLY), a scene folder, or a triangle mesh (PLY with faces).
    pub file: String,
    /// Name of the selection of what was inserted.
    #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// How it finds its place.
    #[serde(default)]
    pub align: AlignDocument,
    /// Where its base comes to stand (with `ground`; default: on the ground below the middle of the scene), or a shift (with
    /// `none`), world units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<[f64; 3]>,
    /// Its own direction up. Default: what its scene folder says, else +z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Degrees about the scene's up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Factor on its size, above 0. Not together with `height`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// Height that it gets, world units, above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height: Option<f64>,
    /// Number of Gaussians that a mesh becomes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub gaussians: Option<u64>,
    /// Material of a mesh or splat that has none: a name of the library.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
}

/// Put something else where the target is, base on base.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SwapOp {
    /// What is replaced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// A splat (PLY), a scene folder, or a triangle mesh (PLY with faces).
    pub file: String,
    /// Name of the selection of what was inserted.
    #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// What it is scaled to.
    #[serde(default)]
    pub fit: FitDocument,
    /// Its own direction up. Default: what its scene folder says, else +z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Degrees about the scene's up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Number of Gaussians that a mesh becomes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub gaussians: Option<u64>,
    /// Material of a mesh or splat that has none: a name of the library.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// What fills the place of what went; the plane it stood on when nothing is said.
    #[serde(default)]
    pub fill: Fill,
}

fn one() -> u64 {
    1
}
