//! The operations.
//!
//! `target` is the name of an earlier selection, or `all`. Left out, it is the selection made last, and everything before
//! the first selection.

mod cleaning;
mod looks;
mod objects;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::documents::brief;

pub use cleaning::*;
pub use looks::*;
pub use objects::*;

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
                            .map_err(|e| (e.path().clone(), brief(e.inner()))),
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
    /// Remove Gaussians with values that are not numbers.
    DropNan(DropNanOp) = "drop_nan",
    /// Merge neighbors until a number is left; mass, mean and covariance of what is merged stay.
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
