//! The operations.
//!
//! `target` is the name of an earlier selection, or `all`. Left out, it is the selection made last, and everything before
//! the first selection.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::values::{
    AlignDocument, AxisAngleDocument, BoxDocument, ColorChangeDocument, ColorModeDocument,
    FillDocument, FitDocument, KeepDocument, OrderDocument, PivotDocument, SphereDocument,
};
use crate::decomposition::ConventionDocument;
use crate::selectors::SelectStep;

macro_rules! operations {
    ($($(#[$doc:meta])* $variant:ident($document:ident) = $name:literal,)*) => {
        /// One operation; the key `op` says which.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "op")]
        pub enum OpDocument {
            $($(#[$doc])* #[serde(rename = $name)] $variant($document),)*
        }

        /// Names of the operations, in the order of the documentation.
        pub const OP_NAMES: &[&str] = &[$($name),*];

        impl OpDocument {
            /// The value of the key `op`.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$variant(_) => $name,)* }
            }

            /// The operation of a name with these keys (without `op`), or why it is none: the path of
            /// keys to the mistake, and a sentence. `None` for an unknown name.
            pub(super) fn from_keys(
                name: &str,
                keys: Map<String, Value>,
            ) -> Option<Result<Self, (serde_path_to_error::Path, String)>> {
                let value = Value::Object(keys);
                match name {
                    $($name => Some(
                        serde_path_to_error::deserialize::<_, $document>(value)
                            .map(Self::$variant)
                            .map_err(|e| (e.path().clone(), e.inner().to_string())),
                    ),)*
                    _ => None,
                }
            }
        }
    };
}

operations! {
    /// Choose Gaussians, and give the choice a name.
    Select(SelectOp) = "select",
    /// Move, rotate and scale about a pivot: scale first, then rotation, then translation.
    Transform(TransformOp) = "transform",
    /// Copy, each copy shifted by a step.
    Duplicate(DuplicateOp) = "duplicate",
    /// Take away, and fill what becomes visible.
    Delete(DeleteOp) = "delete",
    /// Keep the target alone.
    Extract(ExtractOp) = "extract",
    /// Add another splat, scene folder or mesh.
    Insert(InsertOp) = "insert",
    /// Put something else where the target is.
    Swap(SwapOp) = "swap",
    /// Change color.
    Recolor(RecolorOp) = "recolor",
    /// Change what the target is made of.
    SetMaterial(SetMaterialOp) = "set_material",
    /// Put a decomposed scene under another light.
    SetEnvironment(SetEnvironmentOp) = "set_environment",
    /// Mark what shadows may fall on.
    ShadowCatcher(ShadowCatcherOp) = "shadow_catcher",
    /// Keep one side of a region.
    Crop(CropOp) = "crop",
    /// Remove Gaussians that hang far from all others.
    RemoveFloaters(RemoveFloatersOp) = "remove_floaters",
    /// Keep the largest cluster of Gaussians that touch.
    KeepLargest(KeepLargestOp) = "keep_largest",
    /// Remove Gaussians with values that are no numbers.
    DropNan(DropNanOp) = "drop_nan",
    /// Merge neighbours until a number is left; mass, mean and covariance of what is merged stay.
    Decimate(DecimateOp) = "decimate",
    /// Sort.
    Order(OrderOp) = "order",
    /// Drop the bands of spherical harmonics above a degree.
    ShReduce(ShReduceOp) = "sh_reduce",
    /// Report number, box, centroid, base and mean color of the target.
    Measure(MeasureOp) = "measure",
    /// Write a picture of how it looks now.
    Render(RenderOp) = "render",
    /// Edit pictures of the scene with an external program and fit the Gaussians to them.
    Stylize(StylizeOp) = "stylize",
    /// Take back operations before this one.
    Undo(UndoOp) = "undo",
}

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
    pub fill: FillDocument,
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

fn one() -> u64 {
    1
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
    pub fill: FillDocument,
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
    pub fill: FillDocument,
}

/// Change color: base color of a decomposed scene, the shown color of a plain splat.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecolorOp {
    /// What to color.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// How.
    #[serde(default)]
    pub mode: ColorModeDocument,
    /// Linear Rec. 709: 0 to 1 for `tint` and `replace`, factors from 0 for `gain`.
    pub rgb_linear: [f64; 3],
}

/// Change what the target is made of. Keys win over the values of `name`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetMaterialOp {
    /// What to change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// A material of the library, such as `chrome`, `brass`, `matte_black`, `oak`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Base color: diffuse reflectance of a dielectric, reflectance at normal incidence of a metal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_color: Option<ColorChangeDocument>,
    /// Perceptual roughness, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub roughness: Option<f64>,
    /// 0 dielectric, 1 metal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub metallic: Option<f64>,
}

/// Put a decomposed scene under another light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetEnvironmentOp {
    /// Lat-long map (.exr, .hdr), linear.
    pub file: String,
    /// Axes of the map.
    #[serde(default)]
    pub convention: ConventionDocument,
    /// Degrees about the map's up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Factor on the light, above 0: photo value of radiance 1.
    #[serde(default = "unit")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub exposure: f64,
}

fn unit() -> f64 {
    1.0
}

/// Mark what shadows may fall on, for `export` and for shadows on plain splats: the column `shadow_catcher`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShadowCatcherOp {
    /// What catches. Default: the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

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
    /// Number of neighbours that are looked at.
    #[serde(default = "sixteen")]
    #[schemars(range(min = 1, max = 256))]
    pub neighbours: u32,
    /// A Gaussian goes when the logarithm of its distance to its neighbours, less that of its own size where it is
    /// larger than usual, is so many standard deviations above the mean.
    #[serde(default = "three")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub deviations: f64,
}

impl Default for RemoveFloatersOp {
    fn default() -> Self {
        Self { target: None, neighbours: sixteen(), deviations: three() }
    }
}

fn sixteen() -> u32 {
    16
}

fn three() -> f64 {
    3.0
}

/// Keep the largest cluster of Gaussians that touch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeepLargestOp {
    /// Among which; the others stay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Two Gaussians touch when their centres are closer than this many times the median distance to the nearest neighbours,
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

/// Remove Gaussians with values that are no numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DropNanOp {}

/// Merge neighbours until a number is left.
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

/// Report number, box, centroid, base and mean color of the target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasureOp {
    /// Of what.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

/// Write a picture of how it looks now, into the folder of thumbnails.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RenderOp {
    /// Name of the picture, a PNG.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A view of the capture. Default: from the side, see `azimuth_deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<String>,
    /// What the camera looks at when there is no `view`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Where the camera stands around the target, degrees about up.
    #[serde(default)]
    pub azimuth_deg: f64,
    /// How high it stands, degrees above the horizon, -89 to 89.
    #[serde(default = "thirty")]
    #[schemars(range(min = -89.0, max = 89.0))]
    pub elevation_deg: f64,
    /// Longer side, pixels.
    #[serde(default = "preview_side")]
    #[schemars(range(min = 16, max = 8192))]
    pub size: u32,
}

fn thirty() -> f64 {
    30.0
}

fn preview_side() -> u32 {
    480
}

/// Edit pictures of the scene with an external program and fit the Gaussians to them
/// (the loop of Instruct-NeRF2NeRF, Haque et al. 2023). Needs a capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StylizeOp {
    /// What may change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Passed to the editor.
    #[serde(default)]
    pub prompt: String,
    /// Command line: `{input}`, `{output}` and `{prompt}` are replaced by the rendered picture, the picture to write and the
    /// prompt. It is run without a shell.
    pub editor: String,
    /// Training views that are edited, evenly spread; 0: all.
    #[serde(default = "eight")]
    pub views: u32,
    /// Views that are edited first and warped to the others by depth; 0: every view is edited on its own.
    #[serde(default = "three_views")]
    pub key_views: u32,
    /// How often all views are edited again.
    #[serde(default = "two")]
    #[schemars(range(min = 1, max = 100))]
    pub rounds: u32,
    /// Steps of the fit in each round.
    #[serde(default = "steps")]
    #[schemars(range(min = 1, max = 100_000))]
    pub steps: u32,
    /// Weight views by how far they agree with the others.
    #[serde(default = "yes")]
    pub weigh: bool,
}

fn eight() -> u32 {
    8
}

fn three_views() -> u32 {
    3
}

fn two() -> u32 {
    2
}

fn steps() -> u32 {
    200
}

fn yes() -> bool {
    true
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

impl OpDocument {
    /// Keys that refer to selections, and the names.
    pub fn references(&self) -> Vec<(&'static str, &str)> {
        let target = match self {
            Self::Transform(op) => &op.target,
            Self::Duplicate(op) => &op.target,
            Self::Delete(op) => &op.target,
            Self::Extract(op) => &op.target,
            Self::Swap(op) => &op.target,
            Self::Recolor(op) => &op.target,
            Self::SetMaterial(op) => &op.target,
            Self::ShadowCatcher(op) => &op.target,
            Self::RemoveFloaters(op) => &op.target,
            Self::KeepLargest(op) => &op.target,
            Self::Decimate(op) => &op.target,
            Self::Measure(op) => &op.target,
            Self::Render(op) => &op.target,
            Self::Stylize(op) => &op.target,
            Self::Select(op) => {
                return op.from.as_deref().map(|from| ("from", from)).into_iter().collect();
            }
            Self::Insert(_)
            | Self::SetEnvironment(_)
            | Self::Crop(_)
            | Self::DropNan(_)
            | Self::Order(_)
            | Self::ShReduce(_)
            | Self::Undo(_) => &None,
        };
        target.as_deref().map(|target| ("target", target)).into_iter().collect()
    }
}
