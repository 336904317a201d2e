//! Taking Gaussians away.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation};
use crate::EditState;
use crate::changes::delete::delete;
use crate::run::{EditError, Fill, Outcome, Run, applied, rows_of};

/// Take away, and fill what becomes visible.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DeleteOp {
    /// What goes: a selection, never left out before the first selection.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// What fills the place; the plane it stood on when nothing is said.
    #[serde(default)]
    pub fill: Fill,
}

impl Operation for DeleteOp {
    const FLAGS: &'static [Flag] =
        &[Flag::switch("delete", "Delete the selection and fill the hole")];
    const SHARED: &'static [&'static str] = &["fill"];

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        if self.target.is_none() && state.current.is_none() {
            return Err(EditError::plan(format!("{at}/target"), "nothing was selected")
                .remedy("select first: a whole scene is not deleted by leaving something out"));
        }
        let rows = rows_of(state, self.target.as_deref(), at)?;
        run.lift_shadow(state, &rows, at);
        delete(state, &rows, self.fill);
        run.unlit(state, at, "the place that was uncovered stays open and keeps its old light");
        applied(rows.len())
    }
}
