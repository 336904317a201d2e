//! Operations one after another.

use std::collections::BTreeMap;

use glam::DVec3;
use motes_formats::edit_plan::{
    EditPlanDocument, EditRecord, OpDocument, SelectOp, ShadowMode, SkipRecord, StepRecord,
    op_pointer,
};

use super::appearance::{recolor, shadow_catcher};
use super::prepare::{Prepared, absolute};
use super::preview::Preview;
use super::removing::{crop, extract, keep_largest, remove_floaters};
use super::select::select;
use super::values::{keep, measure};
use super::{EditError, Resources};
use crate::EditState;
use crate::ops::{clean, order};

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

/// What came of an operation.
pub(super) enum Outcome {
    Applied(u64, BTreeMap<String, Option<f64>>),
    Skipped(String),
}

pub(super) fn applied(gaussians: usize) -> Result<Outcome, EditError> {
    Ok(Outcome::Applied(gaussians as u64, BTreeMap::new()))
}

pub(super) fn skipped(why: &str) -> Result<Outcome, EditError> {
    Ok(Outcome::Skipped(why.to_owned()))
}

/// Applies a plan that was [prepared](super::prepare).
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
        match run.apply(&plan.ops[i], state, &at)? {
            Outcome::Applied(gaussians, numbers) => {
                let total = state.len() as u64;
                record.applied.push(StepRecord { at, op, gaussians, total, numbers });
            }
            Outcome::Skipped(why) => record.skipped.push(SkipRecord { at, op, why }),
        }
    }
    record.warnings = run.warnings;
    let executed = plan.ops.iter().map(|op| absolute(op, resources.folder)).collect();
    Ok(Edited { executed, record, previews: run.previews })
}

pub(super) struct Run<'a> {
    pub(super) resources: &'a Resources<'a>,
    pub(super) seed: u64,
    /// Whether shadows on a plain splat follow by ratio.
    pub(super) ratio_shadow: bool,
    warnings: Vec<String>,
    pub(super) previews: Vec<Preview>,
}

impl Run<'_> {
    pub(super) fn warn(&mut self, at: &str, text: impl AsRef<str>) {
        self.warnings.push(format!("{} ({at})", text.as_ref()));
    }

    fn apply(
        &mut self,
        op: &OpDocument,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        match op {
            OpDocument::Select(op) => self.select(op, state, at),
            OpDocument::Transform(op) => self.transform(op, state, at),
            OpDocument::Duplicate(op) => self.duplicate(op, state, at),
            OpDocument::Delete(op) => self.delete(op, state, at),
            OpDocument::Extract(op) => extract(op, state, at),
            OpDocument::Insert(op) => self.insert(op, state, at),
            OpDocument::Swap(op) => self.swap(op, state, at),
            OpDocument::Recolor(op) => recolor(op, state, at),
            OpDocument::SetMaterial(op) => self.set_material(op, state, at),
            OpDocument::SetEnvironment(op) => self.set_environment(op, state, at),
            OpDocument::ShadowCatcher(op) => shadow_catcher(op, state, at),
            OpDocument::Crop(op) => crop(op, state, at),
            OpDocument::RemoveFloaters(op) => remove_floaters(op, state, at),
            OpDocument::KeepLargest(op) => keep_largest(op, state, at),
            OpDocument::DropNan(_) => match clean::drop_nan(state) {
                0 => skipped("all values are numbers"),
                n => applied(n),
            },
            OpDocument::Decimate(op) => self.decimate(op, state, at),
            OpDocument::Order(_) => {
                order::morton_order(state);
                applied(state.len())
            }
            OpDocument::ShReduce(op) => match clean::sh_reduce(state, op.degree) {
                true => applied(state.len()),
                false => skipped("there are no bands above this degree"),
            },
            OpDocument::Measure(op) => measure(state, op.target.as_deref(), at),
            OpDocument::Render(op) => self.render(op, state, at),
            OpDocument::Stylize(op) => self.stylize(op, state, at),
            OpDocument::Undo(_) => skipped("undo was resolved before"),
        }
    }

    fn select(&self, op: &SelectOp, state: &mut EditState, at: &str) -> Result<Outcome, EditError> {
        let selection = select(state, op, self.resources, at)?;
        let count = selection.count();
        if count == 0 {
            return Err(EditError::plan(format!("{at}/steps"), "the selection is empty"));
        }
        keep(state, op.id.as_deref(), selection);
        applied(count)
    }
}
