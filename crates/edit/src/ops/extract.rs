//! Keeping the target alone.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation};
use crate::changes::delete::other_rows;
use crate::run::{EditError, Outcome, Run, applied, rows_of};
use crate::{EditState, Fill};

/// Keep the target alone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExtractOp {
    /// What stays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

impl Operation for ExtractOp {
    const FLAGS: &'static [Flag] =
        &[Flag::switch("extract", "Delete everything but the selection")];

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
        let others = other_rows(&rows, state.len());
        state.remove(&others, Fill::None);
        applied(rows.len())
    }
}
