//! Changing color.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::changes::material::{MaterialChange, set_material};
use crate::run::{
    ColorModeDocument, EditError, Fault, Outcome, Run, applied, color, color_values, rows_of,
};

/// Change color: base color of a decomposed scene, the shown color of a plain splat.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecolorOp {
    /// What to color.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// How.
    #[serde(default)]
    pub mode: ColorModeDocument,
    /// Linear Rec. 709: 0 to 1 for `tint` and `replace`, factors from 0 for `gain`.
    pub rgb_linear: [f64; 3],
}

impl Operation for RecolorOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "recolor",
        Short::Numbers("rgb_linear", 3),
        "R,G,B",
        "Change the color of the selection, linear 0 to 1",
    )];

    fn check(&self) -> Result<(), Fault> {
        color_values("/rgb_linear", self.mode, &self.rgb_linear)
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
        let base_color = Some(color(self.mode, self.rgb_linear));
        let change = MaterialChange { base_color, ..MaterialChange::default() };
        let rows = rows_of(state, self.target.as_deref(), at)?;
        set_material(state, &rows, &change);
        applied(rows.len())
    }
}
