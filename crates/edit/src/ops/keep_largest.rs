//! Keeping the largest cluster.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation};
use crate::EditState;
use crate::changes::clusters::outside_largest;
use crate::run::{EditError, Fault, Outcome, Run, positive, remove_found, rows_of};

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

impl Operation for KeepLargestOp {
    const FLAGS: &'static [Flag] =
        &[Flag::switch("keep-largest", "Keep the largest connected cluster")];

    fn check(&self) -> Result<(), Fault> {
        positive("/reach", self.reach)
    }

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
    }

    fn apply(
        &self,
        _run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, self.target.as_deref(), at)?;
        let found = outside_largest(state, &rows, self.reach);
        remove_found(state, &found, "all of it is one cluster")
    }
}

fn three() -> f64 {
    3.0
}
