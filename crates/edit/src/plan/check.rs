//! What types cannot say: ranges, names that refer backwards, keys that exclude each other.

use std::collections::BTreeSet;
use std::path::Path;

use motes_formats::error::{FormatError, Result, quoted};

use super::{EditPlanDocument, MAX_OPS, MAX_RESHADE_SAMPLES};
use crate::ops::OpDocument;
use crate::run::{Fault, MAX_FIT_STEPS, direction};

/// The target that is always there.
const ALL: &str = "all";

/// Pointer to an operation of a plan.
pub fn op_pointer(index: usize) -> String {
    format!("/ops/{index}")
}

/// Checks a plan; `name` stands for the file in errors. Whether files exist and selections fit is seen when
/// they are read.
///
/// # Errors
/// A number is not finite or out of range; a target was not selected by an earlier operation; two selections have one
/// name; keys exclude each other; more is undone than was done.
pub fn check_plan(plan: &EditPlanDocument, name: &Path) -> Result<()> {
    let invalid = |place: String, cause: String, remedy: Option<String>| {
        let error = FormatError::invalid(name, place, cause);
        Err(match remedy {
            Some(remedy) => error.with_remedy(remedy),
            None => error,
        })
    };
    if plan.ops.len() > MAX_OPS {
        let cause = format!("{} operations are more than {MAX_OPS}", plan.ops.len());
        return invalid(format!("/ops/{MAX_OPS}"), cause, Some("split the plan".into()));
    }
    if let Some(up) = plan.up_in_world
        && let Err((_, cause, _)) = direction("", &up)
    {
        return invalid("/up_in_world".into(), cause, None);
    }
    if let Some(steps) = plan.refit_steps.filter(|steps| *steps > MAX_FIT_STEPS) {
        let cause = format!("{steps} is not from 0 to {MAX_FIT_STEPS}");
        return invalid("/refit_steps".into(), cause, None);
    }
    if let Some(samples) = plan.reshade_samples.filter(|samples| *samples > MAX_RESHADE_SAMPLES) {
        let cause = format!("{samples} is not from 0 to {MAX_RESHADE_SAMPLES}");
        return invalid("/reshade_samples".into(), cause, None);
    }
    let later = names(plan);
    let mut known = BTreeSet::new();
    // What may be undone, and the names that go with it.
    let mut done: Vec<Option<&str>> = Vec::new();
    let mut taken = BTreeSet::new();
    for (i, op) in plan.ops.iter().enumerate() {
        let checked = op
            .check()
            .and_then(|()| check_target(op, &known, &taken, &later))
            .and_then(|()| check_undo(op, done.len() as u64));
        if let Err((place, cause, remedy)) = checked {
            return invalid(format!("{}{place}", op_pointer(i)), cause, remedy);
        }
        if let Some((key, id)) = op.defines() {
            let place = || format!("{}/{key}", op_pointer(i));
            if id.is_empty() || id == ALL {
                return invalid(place(), format!("{} cannot name a selection", quoted(id)), None);
            }
            if !known.insert(id.to_owned()) {
                let cause = format!("the name {} is given twice", quoted(id));
                return invalid(place(), cause, None);
            }
        }
        if let OpDocument::Undo(undo) = op {
            for name in done.drain(done.len() - undo.steps as usize..).flatten() {
                taken.extend(known.take(name));
            }
        } else {
            done.push(op.defines().map(|(_, id)| id));
        }
    }
    Ok(())
}

/// Names that a plan defines anywhere.
fn names(plan: &EditPlanDocument) -> BTreeSet<String> {
    plan.ops.iter().filter_map(|op| op.defines().map(|(_, id)| id.to_owned())).collect()
}

fn check_target(
    op: &OpDocument,
    known: &BTreeSet<String>,
    taken: &BTreeSet<String>,
    later: &BTreeSet<String>,
) -> std::result::Result<(), Fault> {
    if let Some((key, target)) = op.refers_to() {
        if target == ALL || known.contains(target) {
            return Ok(());
        }
        let own = op.defines().is_some_and(|(_, id)| id == target);
        let cause = match () {
            () if own => format!("{} refers to itself", quoted(target)),
            () if taken.contains(target) => {
                format!("the operation that makes {} was taken back", quoted(target))
            }
            () if later.contains(target) => {
                format!("{} is made by a later operation", quoted(target))
            }
            () => format!("no earlier operation selects {}", quoted(target)),
        };
        let remedy = "select it first: {\"op\": \"select\", \"id\": ..., ...}";
        return Err((format!("/{key}"), cause, Some(remedy.into())));
    }
    Ok(())
}

fn check_undo(op: &OpDocument, undoable: u64) -> std::result::Result<(), Fault> {
    match op {
        OpDocument::Undo(undo) if undo.steps == 0 || undo.steps > undoable => {
            let cause = format!("{} steps cannot be undone, {undoable} were done", undo.steps);
            Err(("/steps".into(), cause, None))
        }
        _ => Ok(()),
    }
}
