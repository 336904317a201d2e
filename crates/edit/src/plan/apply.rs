//! Operations one after another.

use glam::DVec3;

use super::check::op_pointer;
use super::document::EditPlanDocument;
use super::record::{EditRecord, SkipRecord, StepRecord};
use crate::EditState;
use crate::ops::OpDocument;
use crate::run::{EditError, Outcome, Preview, Resources, Run, ShadowMode};

/// What came of a plan.
#[derive(Clone, Debug, Default)]
pub struct Edited {
    /// The plan as it was executed: files by absolute path.
    pub executed: Vec<OpDocument>,
    /// What was applied and what was not.
    pub record: EditRecord,
    /// Pictures that the plan asked for.
    pub previews: Vec<Preview>,
}

/// Which operations of a plan are applied.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Prepared {
    /// Indices, in order.
    pub effective: Vec<usize>,
    /// Operations that an `undo` takes back, and the index of that `undo`.
    pub undone: Vec<(usize, usize)>,
}

/// Applies a plan that was [prepared](crate::files::prepare).
///
/// # Errors
/// A target is empty, a selection is stale, a file is broken, or the user asked to stop.
pub fn run_plan(
    plan: &EditPlanDocument,
    prepared: &Prepared,
    state: &mut EditState,
    resources: &Resources<'_>,
) -> Result<Edited, EditError> {
    if let Some(up) = plan.up_in_world {
        state.up_in_world = DVec3::from_array(up).normalize_or(DVec3::Z);
    }
    let seed = plan.seed;
    let ratio_shadow = plan.shadow == ShadowMode::Ratio && state.parts.is_none();
    let mut run = Run { resources, seed, ratio_shadow, warnings: Vec::new(), previews: Vec::new() };
    let mut record = EditRecord::default();
    for (taken, by) in &prepared.undone {
        let (at, op) = (op_pointer(*taken), plan.ops[*taken].name().into());
        record.skipped.push(SkipRecord {
            at,
            op,
            why: format!("taken back by {}", op_pointer(*by)),
        });
    }
    for &i in &prepared.effective {
        if (resources.stopped)() {
            return Err(EditError::Stopped);
        }
        let (at, op) = (op_pointer(i), plan.ops[i].name().to_owned());
        match plan.ops[i].apply(&mut run, state, &at)? {
            Outcome::Applied(gaussians, numbers) => {
                let total = state.len() as u64;
                record.applied.push(StepRecord { at, op, gaussians, total, numbers });
            }
            Outcome::Skipped(why) => record.skipped.push(SkipRecord { at, op, why }),
        }
    }
    record.warnings = run.warnings;
    let executed = plan.ops.iter().map(|op| absolute(op, resources)).collect();
    Ok(Edited { executed, record, previews: run.previews })
}

/// The operation with every file named by its absolute path, so that it means the same from any folder.
fn absolute(op: &OpDocument, resources: &Resources<'_>) -> OpDocument {
    let mut op = op.clone();
    op.files().into_iter().for_each(|(_, name)| *name = resources.absolute(name));
    op
}
