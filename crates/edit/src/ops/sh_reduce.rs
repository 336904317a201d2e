//! Dropping bands of spherical harmonics.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::changes::clean;
use crate::run::{EditError, Fault, Outcome, Run, applied, skipped};

/// Drop the bands of spherical harmonics above a degree.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShReduceOp {
    /// Highest degree that stays, 0 to 4.
    #[schemars(range(min = 0, max = 4))]
    pub degree: u8,
}

impl Operation for ShReduceOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "sh-reduce",
        Short::Number("degree"),
        "DEGREE",
        "Drop spherical harmonics above a degree",
    )];

    fn check(&self) -> Result<(), Fault> {
        if self.degree <= 4 {
            return Ok(());
        }
        Err(("/degree".into(), format!("{} is not a degree from 0 to 4", self.degree), None))
    }

    fn apply(
        &self,
        _run: &mut Run<'_>,
        state: &mut EditState,
        _at: &str,
    ) -> Result<Outcome, EditError> {
        match clean::sh_reduce(state, self.degree) {
            true => applied(state.len()),
            false => skipped("there are no bands above this degree"),
        }
    }
}
