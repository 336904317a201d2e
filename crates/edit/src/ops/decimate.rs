//! Merging neighbors until a number is left.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::changes::decimate::decimate;
use crate::run::{EditError, Fault, Outcome, Run, applied, bounded, rows_of, skipped};

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

impl Operation for DecimateOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "decimate",
        Short::Number("count"),
        "COUNT",
        "Merge neighbors down to this number of Gaussians",
    )];

    fn check(&self) -> Result<(), Fault> {
        bounded("/count", self.count, u64::from(u32::MAX))
    }

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, self.target.as_deref(), at)?;
        if self.count >= rows.len() as u64 {
            return skipped("there are no more than that");
        }
        let left = decimate(state, &rows, self.count as usize);
        if left as u64 > self.count {
            run.warn(at, format!("{left} are left: the others have values that are not numbers"));
        }
        applied(rows.len() - left)
    }
}
