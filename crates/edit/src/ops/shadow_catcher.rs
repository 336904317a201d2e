//! Marking what shadows may fall on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation};
use crate::EditState;
use crate::changes::ground;
use crate::run::{EditError, Outcome, Run, applied, rows_of};

/// Mark what shadows may fall on, for `export` and for shadows on plain splats: the column `shadow_catcher`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShadowCatcherOp {
    /// What catches. Default: the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

impl Operation for ShadowCatcherOp {
    const FLAGS: &'static [Flag] =
        &[Flag::switch("shadow-catcher", "Mark the ground as a shadow catcher")];

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
    }

    fn apply(
        &self,
        _run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = match &self.target {
            Some(target) => rows_of(state, Some(target), at)?,
            None => ground::find_ground(&state.gaussians, state.up_in_world)
                .map(|found| ground::rows_on(&state.gaussians, &found))
                .unwrap_or_default(),
        };
        if rows.is_empty() {
            return Err(EditError::plan(at, "there is no ground for shadows to fall on")
                .remedy("select what catches shadows and name it as \"target\""));
        }
        ground::mark_catcher(state, &rows);
        applied(rows.len())
    }
}
