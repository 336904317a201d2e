//! Taking back operations: resolved before a plan is applied.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::run::{EditError, Outcome, Run, skipped};

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

impl Operation for UndoOp {
    const FLAGS: &'static [Flag] =
        &[Flag::of("undo", Short::Number("steps"), "STEPS", "Undo this many operations")
            .or_alone()];

    fn apply(
        &self,
        _run: &mut Run<'_>,
        _state: &mut EditState,
        _at: &str,
    ) -> Result<Outcome, EditError> {
        skipped("undo was resolved before")
    }
}

fn one() -> u64 {
    1
}
