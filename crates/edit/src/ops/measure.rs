//! Numbers about the target.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use super::operation::{Flag, Operation};
use crate::EditState;
use crate::changes::measure::{Extent, mean_color_linear};
use crate::run::{EditError, Outcome, Run, rows_of};

/// Report number, box, centroid, base and mean color of the target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasureOp {
    /// Of what.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

impl Operation for MeasureOp {
    const FLAGS: &'static [Flag] =
        &[Flag::switch("measure", "Report position and size of the selection")];

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
        let mut numbers = BTreeMap::new();
        let mut put = |name: &str, value: f64| {
            numbers.insert(name.to_owned(), Some(value).filter(|v| v.is_finite()));
        };
        if let Some(extent) = Extent::of(&state.gaussians, &rows, state.up_in_world) {
            let base = extent.base();
            for (name, p) in [
                ("min", extent.min),
                ("max", extent.max),
                ("centroid", extent.centroid),
                ("base", base),
            ] {
                for (axis, value) in ["x", "y", "z"].into_iter().zip(p.to_array()) {
                    put(&format!("{name}_{axis}"), value);
                }
            }
            put("height", extent.height());
            put("footprint", extent.footprint());
        }
        if let Some(color) = mean_color_linear(&state.gaussians, &rows) {
            for (channel, value) in ["r", "g", "b"].into_iter().zip(color) {
                put(&format!("mean_linear_{channel}"), value);
            }
        }
        Ok(Outcome::Applied(rows.len() as u64, numbers))
    }
}
