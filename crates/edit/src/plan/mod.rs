//! A plan: its document, what is checked before any Gaussian is read, and how it is applied to a state.
//!
//! [`prepare`](crate::files::prepare) checks what needs no Gaussians: files, names, which operations an `undo` takes back. [`run_plan`] applies the rest in
//! order. Nothing is written here: pictures and the record are returned.

mod apply;
mod check;
mod document;
mod parse;
mod record;

pub use apply::{Edited, Prepared, run_plan};
pub use check::{check_plan, op_pointer};
pub use document::{EditPlanDocument, MAX_OPS, MAX_PLAN_BYTES, MAX_RESHADE_SAMPLES};
pub use parse::{parse_edit_plan, parse_op};
pub use record::{EditRecord, SkipRecord, StepRecord};

#[cfg(test)]
mod tests;
