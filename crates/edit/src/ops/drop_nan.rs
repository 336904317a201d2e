//! Removing Gaussians with values that are not numbers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation};
use crate::EditState;
use crate::changes::clean;
use crate::run::{EditError, Outcome, Run, applied, skipped};

/// Remove Gaussians with values that are not numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DropNanOp {}

impl Operation for DropNanOp {
    const FLAGS: &'static [Flag] =
        &[Flag::switch("drop-nan", "Remove Gaussians with NaN or infinite values")];

    fn apply(
        &self,
        _run: &mut Run<'_>,
        state: &mut EditState,
        _at: &str,
    ) -> Result<Outcome, EditError> {
        match clean::drop_nan(state) {
            0 => skipped("all values are numbers"),
            n => applied(n),
        }
    }
}
