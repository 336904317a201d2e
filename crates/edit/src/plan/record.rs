//! What a run did with a plan.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a run did with a plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EditRecord {
    /// Program and version.
    #[serde(default)]
    pub made_by: String,
    /// SHA-256 of the Gaussians that the plan was applied to, hexadecimal.
    #[serde(default)]
    pub gaussians_sha256: String,
    /// Operations that changed something or answered.
    #[serde(default)]
    pub applied: Vec<StepRecord>,
    /// Operations that did not, and why.
    #[serde(default)]
    pub skipped: Vec<SkipRecord>,
    /// What may be wrong.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// An operation that was applied.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepRecord {
    /// JSON pointer into the plan.
    pub at: String,
    /// Its name.
    pub op: String,
    /// Gaussians that it was about.
    pub gaussians: u64,
    /// Gaussians that are there after it.
    pub total: u64,
    /// What was measured, by name; null where there is no number.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub numbers: BTreeMap<String, Option<f64>>,
}

/// An operation that was not applied.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SkipRecord {
    /// JSON pointer into the plan.
    pub at: String,
    /// Its name.
    pub op: String,
    /// A sentence.
    pub why: String,
}
