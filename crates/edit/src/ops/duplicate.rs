//! Copies.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::changes::duplicate::duplicate;
use crate::changes::measure::Bounds;
use crate::changes::ratio_shadow::RatioShadow;
use crate::run::{
    EditError, Fault, Outcome, Run, applied, bounded, finite, keep, rows_of, within_range,
};

/// Copies that one operation may make.
const MAX_COUNT: u64 = 10_000;
/// Copies make no more than so many: about 10 GiB of memory with colors of degree 3. Copies of copies would fill any machine.
const MAX_GAUSSIANS: usize = 20_000_000;

/// Copy, each copy shifted by a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DuplicateOp {
    /// What to copy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Name of the selection of all copies.
    #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Shift from one copy to the next, world units.
    pub translate: [f64; 3],
    /// Number of copies.
    #[serde(default = "one")]
    #[schemars(range(min = 1, max = 10_000))]
    pub count: u64,
}

impl Operation for DuplicateOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "duplicate",
        Short::Numbers("translate", 3),
        "X,Y,Z",
        "Duplicate with an offset, world units",
    )];

    fn check(&self) -> Result<(), Fault> {
        finite("/translate", &self.translate)?;
        bounded("/count", self.count, MAX_COUNT)
    }

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
    }

    fn defines(&self) -> Option<(&'static str, &str)> {
        self.name.as_deref().map(|name| ("as", name))
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, self.target.as_deref(), at)?;
        let copies = rows.len().saturating_mul(self.count as usize);
        if state.len().saturating_add(copies) > MAX_GAUSSIANS {
            let cause = format!(
                "{copies} copies and {} are more than {MAX_GAUSSIANS} Gaussians",
                state.len()
            );
            return Err(EditError::plan(format!("{at}/count"), cause)
                .remedy("copy less, or merge files that are written one by one"));
        }
        let step = DVec3::from_array(self.translate);
        let bounds = Bounds::of(&state.gaussians, rows.iter().copied());
        within_range(bounds, at, |p| p + step * self.count as f64)?;
        let shadow = run.ratio_shadow.then(|| RatioShadow::read(state, &rows)).flatten();
        let selection = duplicate(state, &rows, step, self.count as usize);
        let copied = selection.rows();
        for k in 1..=self.count {
            if let Some(shadow) = &shadow {
                shadow.apply(&mut state.gaussians, step * k as f64, false, &copied);
            }
        }
        keep(state, self.name.as_deref(), selection);
        run.unlit(state, at, "the copies cast no shadow");
        applied(copies)
    }
}

fn one() -> u64 {
    1
}
