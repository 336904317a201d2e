//! The operations: a file each, named in the list [`OpDocument`].
//!
//! `target` is the name of an earlier selection, or `all`. Left out, it is the selection made last, and everything before
//! the first selection.

mod compose;
mod crop;
mod decimate;
mod delete;
mod drop_nan;
mod duplicate;
mod extract;
mod insert;
mod keep_largest;
mod measure;
mod operation;
mod order;
mod recolor;
mod remove_floaters;
mod render;
mod select;
mod set_environment;
mod set_material;
mod sh_reduce;
mod shadow_catcher;
mod stylize;
mod swap;
mod transform;
mod undo;

use motes_formats::documents::brief;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::EditState;
use crate::run::{EditError, Fault, Outcome, Program, Run};
use operation::Operation;
pub(crate) use operation::{Flag, Short};

macro_rules! operations {
    ($($(#[$doc:meta])* $module:ident::$variant:ident($document:ident) = $name:literal,)*) => {
        $(pub use $module::$document;)*

        /// One operation; the key `op` says which.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "op")]
        pub enum OpDocument {
            $($(#[$doc])* #[serde(rename = $name)] $variant($document),)*
        }

        /// Names of the operations, in the order of the documentation.
        pub const OP_NAMES: &[&str] = &[$($name),*];

        /// Operations as flags: the name of each, its flags, and those that it shares with others.
        pub(crate) const OP_FLAGS: &[(&str, &[Flag], &[&str])] =
            &[$(($name, $document::FLAGS, $document::SHARED)),*];

        impl OpDocument {
            /// The value of the key `op`.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$variant(_) => $name,)* }
            }

            /// The operation of a name with these keys (without `op`), or the path of keys to the mistake and a sentence.
            /// `None` for an unknown name.
            pub(crate) fn from_keys(
                name: &str,
                keys: Map<String, Value>,
            ) -> Option<Result<Self, (serde_path_to_error::Path, String)>> {
                match name {
                    $($name => {
                        let mistake = $document::mistake(&keys);
                        let read = serde_path_to_error::deserialize(Value::Object(keys));
                        Some(read.map(Self::$variant).map_err(|error| {
                            let cause = mistake.unwrap_or_else(|| brief(error.inner()));
                            (error.path().clone(), cause)
                        }))
                    })*
                    _ => None,
                }
            }

            pub(crate) fn check(&self) -> Result<(), Fault> {
                match self { $(Self::$variant(op) => op.check(),)* }
            }

            pub(crate) fn refers_to(&self) -> Option<(&'static str, &str)> {
                match self { $(Self::$variant(op) => op.refers_to(),)* }
            }

            pub(crate) fn defines(&self) -> Option<(&'static str, &str)> {
                match self { $(Self::$variant(op) => op.defines(),)* }
            }

            /// Files that it reads: the pointer of each below the operation, and its name.
            pub fn files(&mut self) -> Vec<(String, &mut String)> {
                match self { $(Self::$variant(op) => op.files(),)* }
            }

            pub(crate) fn material(&self) -> Option<(&'static str, &str)> {
                match self { $(Self::$variant(op) => op.material(),)* }
            }

            pub(crate) fn program(&self) -> Program<'_> {
                match self { $(Self::$variant(op) => op.program(),)* }
            }

            pub(crate) fn apply(
                &self,
                run: &mut Run<'_>,
                state: &mut EditState,
                at: &str,
            ) -> Result<Outcome, EditError> {
                match self { $(Self::$variant(op) => op.apply(run, state, at),)* }
            }
        }
    };
}

operations! {
    /// Choose Gaussians, and give the choice a name.
    select::Select(SelectOp) = "select",
    /// Move, rotate and scale about a pivot: scale first, then rotation, then translation.
    transform::Transform(TransformOp) = "transform",
    /// Copy, each copy shifted by a step.
    duplicate::Duplicate(DuplicateOp) = "duplicate",
    /// Take away, and fill what becomes visible.
    delete::Delete(DeleteOp) = "delete",
    /// Keep the target alone.
    extract::Extract(ExtractOp) = "extract",
    /// Add another splat, scene folder or mesh.
    insert::Insert(InsertOp) = "insert",
    /// Add an asset at its size, on the ground, under the light of its place, with its shadow and bounce.
    compose::Compose(ComposeOp) = "compose",
    /// Put something else where the target is.
    swap::Swap(SwapOp) = "swap",
    /// Change color.
    recolor::Recolor(RecolorOp) = "recolor",
    /// Change what the target is made of.
    set_material::SetMaterial(SetMaterialOp) = "set_material",
    /// Put a decomposed scene under another light.
    set_environment::SetEnvironment(SetEnvironmentOp) = "set_environment",
    /// Mark what shadows may fall on.
    shadow_catcher::ShadowCatcher(ShadowCatcherOp) = "shadow_catcher",
    /// Keep one side of a region.
    crop::Crop(CropOp) = "crop",
    /// Remove Gaussians that hang far from all others.
    remove_floaters::RemoveFloaters(RemoveFloatersOp) = "remove_floaters",
    /// Keep the largest cluster of Gaussians that touch.
    keep_largest::KeepLargest(KeepLargestOp) = "keep_largest",
    /// Remove Gaussians with values that are not numbers.
    drop_nan::DropNan(DropNanOp) = "drop_nan",
    /// Merge neighbors until a number is left; mass, mean and covariance of what is merged stay.
    decimate::Decimate(DecimateOp) = "decimate",
    /// Sort.
    order::Order(OrderOp) = "order",
    /// Drop the bands of spherical harmonics above a degree.
    sh_reduce::ShReduce(ShReduceOp) = "sh_reduce",
    /// Report number, box, centroid, base and mean color of the target.
    measure::Measure(MeasureOp) = "measure",
    /// Write a picture of how it looks now.
    render::Render(RenderOp) = "render",
    /// Edit pictures of the scene with an external program and fit the Gaussians to them.
    stylize::Stylize(StylizeOp) = "stylize",
    /// Take back operations before this one.
    undo::Undo(UndoOp) = "undo",
}
