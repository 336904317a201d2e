//! Removing Gaussians that hang far from all others.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation};
use crate::EditState;
use crate::changes::floaters::floaters;
use crate::run::{EditError, Fault, Outcome, Run, bounded, positive, remove_found, rows_of};

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

impl Operation for RemoveFloatersOp {
    const FLAGS: &'static [Flag] = &[Flag::switch("remove-floaters", "Remove isolated Gaussians")];

    fn check(&self) -> Result<(), Fault> {
        bounded("/neighbours", u64::from(self.neighbors), 256)?;
        positive("/deviations", self.deviations)
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
        let found = floaters(state, &rows, self.neighbors as usize, self.deviations);
        remove_found(state, &found, "nothing hangs far from the others")
    }
}

fn sixteen() -> u32 {
    16
}

fn three() -> f64 {
    3.0
}
