//! What the operations of a plan share: the files and cameras that they may look at, what they answer, their targets, and the
//! ranges of their values.

mod composing;
mod context;
mod inserting;
mod options;
mod preview;
mod ranges;
mod shadows;
mod steps;
mod targets;
mod values;

use std::collections::BTreeMap;

pub(crate) use composing::LightWanted;
pub use context::{EditError, Editors, Program, Resources};
pub(crate) use inserting::Wanted;
pub use options::ShadowMode;
pub use preview::{Preview, orbit_camera, picture, whole_extent};
pub(crate) use ranges::{
    Fault, bounded, color_values, direction, finite, mesh_count, positive, range,
};
pub(crate) use steps::check_steps;
pub(crate) use targets::{
    color, extent_of, flat, keep, remove_found, rows_of, some_place, within_range,
};
pub use values::*;

/// Coordinates, lengths and factors beyond, and factors below its inverse, do not survive squares in single precision.
pub const LARGEST: f64 = 1e18;
/// Most steps of a fit.
pub const MAX_FIT_STEPS: u32 = 100_000;

/// What came of an operation.
pub(crate) enum Outcome {
    Applied(u64, BTreeMap<String, Option<f64>>),
    Skipped(String),
}

pub(crate) fn applied(gaussians: usize) -> Result<Outcome, EditError> {
    Ok(Outcome::Applied(gaussians as u64, BTreeMap::new()))
}

pub(crate) fn skipped(why: &str) -> Result<Outcome, EditError> {
    Ok(Outcome::Skipped(why.to_owned()))
}

/// A plan while it is applied.
pub(crate) struct Run<'a> {
    pub(crate) resources: &'a Resources<'a>,
    pub(crate) seed: u64,
    /// Whether shadows on a plain splat follow by ratio.
    pub(crate) ratio_shadow: bool,
    pub(crate) warnings: Vec<String>,
    pub(crate) previews: Vec<Preview>,
}

impl Run<'_> {
    /// Says what may be wrong with the operation at `at`.
    pub(crate) fn warn(&mut self, at: &str, text: impl AsRef<str>) {
        self.warnings.push(format!("{} ({at})", text.as_ref()));
    }
}
