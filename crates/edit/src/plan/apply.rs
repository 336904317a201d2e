//! Operations one after another.

use std::collections::BTreeMap;

use glam::DVec3;
use motes_formats::edit_plan::{
    ColorChangeDocument, CropOp, DecimateOp, EditPlanDocument, EditRecord, KeepDocument,
    OpDocument, SetMaterialOp, ShadowDocument, SkipRecord, StepRecord, op_pointer,
};

use super::light::set_environment;
use super::prepare::{Prepared, absolute};
use super::preview::Preview;
use super::select::select;
use super::style::apply_style;
use super::values::{color, fill, keep, measure, rows_of};
use super::{EditError, Resources};
use crate::ops::color::{ColorChange, ColorMode};
use crate::ops::material::{MaterialChange, MaterialOutcome, set_material};
use crate::ops::materials::material_named;
use crate::ops::{clean, clusters, decimate, delete, floaters, ground, order};
use crate::{EditState, Fill};

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
    let ratio_shadow = plan.shadow == ShadowDocument::Ratio && state.parts.is_none();
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
    seed: u64,
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
            OpDocument::Select(op) => {
                let selection = select(state, op, self.resources, at)?;
                let count = selection.count();
                if count == 0 {
                    return Err(EditError::plan(format!("{at}/steps"), "the selection is empty"));
                }
                keep(state, op.id.as_deref(), selection);
                applied(count)
            }
            OpDocument::Transform(op) => self.transform(op, state, at),
            OpDocument::Duplicate(op) => self.duplicate(op, state, at),
            OpDocument::Delete(op) => {
                if op.target.is_none() && state.current.is_none() {
                    return Err(EditError::plan(format!("{at}/target"), "nothing was selected")
                        .remedy(
                            "select first: a whole scene is not deleted by leaving something out",
                        ));
                }
                let rows = rows_of(state, op.target.as_deref(), at)?;
                self.lift_shadow(state, &rows, at);
                delete::delete(state, &rows, fill(op.fill));
                self.unlit(
                    state,
                    at,
                    "the place that was uncovered stays open and keeps its old light",
                );
                applied(rows.len())
            }
            OpDocument::Extract(op) => {
                let rows = rows_of(state, op.target.as_deref(), at)?;
                let others = delete::other_rows(&rows, state.len());
                state.remove(&others, Fill::None);
                applied(rows.len())
            }
            OpDocument::Insert(op) => self.insert(op, state, at),
            OpDocument::Swap(op) => self.swap(op, state, at),
            OpDocument::Recolor(op) => {
                let base_color = Some(color(op.mode, op.rgb_linear));
                let change = MaterialChange { base_color, ..MaterialChange::default() };
                let rows = rows_of(state, op.target.as_deref(), at)?;
                set_material(state, &rows, &change);
                applied(rows.len())
            }
            OpDocument::SetMaterial(op) => self.set_material(op, state, at),
            OpDocument::SetEnvironment(op) => match &mut state.parts {
                None => skipped("a plain splat has its light in its colours: decompose it first"),
                Some(parts) => {
                    set_environment(parts, op, state.up_in_world, self.resources, at)?;
                    applied(state.len())
                }
            },
            OpDocument::ShadowCatcher(op) => {
                let rows = match &op.target {
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
            OpDocument::Crop(op) => self.crop(op, state, at),
            OpDocument::RemoveFloaters(op) => {
                let rows = rows_of(state, op.target.as_deref(), at)?;
                let found = floaters::floaters(state, &rows, op.neighbours as usize, op.deviations);
                self.remove_found(state, &found, "nothing hangs far from the others", at)
            }
            OpDocument::KeepLargest(op) => {
                let rows = rows_of(state, op.target.as_deref(), at)?;
                let found = clusters::outside_largest(state, &rows, op.reach);
                self.remove_found(state, &found, "all of it is one cluster", at)
            }
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
            OpDocument::Stylize(op) => {
                let rows = rows_of(state, op.target.as_deref(), at)?;
                let numbers = apply_style(state, &rows, op, self.seed, self.resources, at)?;
                if state.parts.is_some() {
                    self.warn(
                        at,
                        "colours changed, base colors did not: relighting shows the old ones",
                    );
                }
                Ok(Outcome::Applied(rows.len() as u64, numbers))
            }
            OpDocument::Undo(_) => skipped("undo was resolved before"),
        }
    }

    fn set_material(
        &mut self,
        op: &SetMaterialOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, op.target.as_deref(), at)?;
        let mut change = MaterialChange::default();
        if let Some(material) = op.name.as_deref().and_then(material_named) {
            let rgb_linear = material.base_color_linear;
            change.base_color = Some(ColorChange { mode: ColorMode::Even, rgb_linear });
            (change.roughness, change.metallic) =
                (Some(material.roughness), Some(material.metallic));
        }
        if let Some(ColorChangeDocument { mode, rgb_linear }) = op.base_color {
            change.base_color = Some(color(mode, rgb_linear));
        }
        change.roughness = op.roughness.map(|v| v as f32).or(change.roughness);
        change.metallic = op.metallic.map(|v| v as f32).or(change.metallic);
        match set_material(state, &rows, &change) {
            MaterialOutcome::Columns => applied(rows.len()),
            MaterialOutcome::Shown if change.base_color.is_none() => {
                skipped("a plain splat has no roughness and no metallic: decompose it first")
            }
            MaterialOutcome::Shown => {
                self.unlit(state, at, "only the colour changed, not how it reflects");
                applied(rows.len())
            }
        }
    }

    fn crop(&mut self, op: &CropOp, state: &mut EditState, at: &str) -> Result<Outcome, EditError> {
        let inside = match (&op.r#box, &op.sphere) {
            (Some(b), _) => {
                delete::rows_in_box(state, DVec3::from_array(b.min), DVec3::from_array(b.max))
            }
            (_, Some(s)) => delete::rows_in_sphere(state, DVec3::from_array(s.center), s.radius),
            _ => Vec::new(),
        };
        let outside = delete::other_rows(&inside, state.len());
        let (kept, gone) = match op.keep {
            KeepDocument::Inside => (inside, outside),
            KeepDocument::Outside => (outside, inside),
        };
        if kept.is_empty() {
            return Err(EditError::plan(at, "nothing would be left")
                .remedy("the report of \"measure\" says where the Gaussians are"));
        }
        self.remove_found(state, &gone, "nothing lies on the side that goes", at)
    }

    fn remove_found(
        &mut self,
        state: &mut EditState,
        rows: &[u32],
        none: &str,
        _at: &str,
    ) -> Result<Outcome, EditError> {
        if rows.is_empty() {
            return skipped(none);
        }
        state.remove(rows, Fill::None);
        applied(rows.len())
    }

    fn decimate(
        &mut self,
        op: &DecimateOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, op.target.as_deref(), at)?;
        if op.count >= rows.len() as u64 {
            return skipped("there are no more than that");
        }
        let left = decimate::decimate(state, &rows, op.count as usize);
        if left as u64 > op.count {
            self.warn(at, format!("{left} are left: the others have values that are no numbers"));
        }
        applied(rows.len() - left)
    }
}
