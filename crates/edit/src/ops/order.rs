//! Sorting.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::changes::order::morton_order;
use crate::run::{EditError, OrderDocument, Outcome, Run, applied};

/// Sort.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OrderOp {
    /// Along what.
    #[serde(default)]
    pub by: OrderDocument,
}

impl Operation for OrderOp {
    const FLAGS: &'static [Flag] =
        &[Flag::of("order", Short::Text("by"), "morton", "Sort along a Morton curve").or_alone()];

    fn apply(
        &self,
        _run: &mut Run<'_>,
        state: &mut EditState,
        _at: &str,
    ) -> Result<Outcome, EditError> {
        match self.by {
            OrderDocument::Morton => morton_order(state),
        }
        applied(state.len())
    }
}
