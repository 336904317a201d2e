//! `edit-plan.json`: operations on a splat or a decomposed scene, one after another.
//!
//! Made to be written by people, by `edit` itself (its log is a plan) and by programs that call tools: every operation is one
//! object with the key `op`, every key has a sentence in the schema, and a mistake is answered with a JSON pointer to
//! its place.

use motes_formats::documents::Document;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::record::EditRecord;
use crate::ops::OpDocument;
use crate::run::ShadowMode;

/// Plans with more operations are refused.
pub const MAX_OPS: usize = 10_000;
/// Most directions toward the light.
pub const MAX_RESHADE_SAMPLES: u32 = 65_536;
/// Plans with more bytes are refused before they are read.
pub const MAX_PLAN_BYTES: u64 = 16 << 20;

/// Operations on a splat or a decomposed scene, applied in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes edit plan")]
pub struct EditPlanDocument {
    /// `motes/edit-plan`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Seed of everything random. The same plan, input and seed give the same bytes.
    #[serde(default)]
    pub seed: u64,
    /// Direction away from the ground, any length above 0. Default: what a decomposed scene says, else the mean up
    /// of the cameras when a capture is given, else +z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up_in_world: Option<[f64; 3]>,
    /// What happens to shadows on a plain splat. Decomposed scenes trace theirs.
    #[serde(default)]
    pub shadow: ShadowMode,
    /// Steps of the fit of fillings to the photos, where a decomposed scene is edited with a capture; 0: none. Default: what the
    /// program finds enough when there is a capture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 100_000))]
    pub refit_steps: Option<u32>,
    /// Directions toward the light per Gaussian that light is traced along after an edit of a decomposed scene; 0: light does not
    /// follow, shadows stay. Default: 64.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 65_536))]
    pub reshade_samples: Option<u32>,
    /// The operations, at most 10 000. Files are named relative to this document.
    #[schemars(length(max = 10_000))]
    pub ops: Vec<OpDocument>,
    /// What a run did with the plan: `edit` writes it into its log and does not read it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub record: Option<EditRecord>,
}

impl Document for EditPlanDocument {
    const FORMAT: &'static str = "motes/edit-plan";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 7;
}

impl EditPlanDocument {
    /// A plan of operations.
    pub fn new(seed: u64, ops: Vec<OpDocument>) -> Self {
        Self {
            format: Self::FORMAT.into(),
            version: Self::version(),
            seed,
            up_in_world: None,
            shadow: ShadowMode::None,
            refit_steps: None,
            reshade_samples: None,
            ops,
            record: None,
        }
    }
}
