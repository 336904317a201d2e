//! The operations that move and copy.

use glam::{DQuat, DVec3};
use motes_formats::edit_plan::{DuplicateOp, LARGEST, PivotDocument, PivotName, TransformOp};

use super::EditError;
use super::apply::{Outcome, Run, applied, skipped};
use super::values::{extent_of, keep, rotation_of, rows_of, some_place};
use crate::ops::measure::Bounds;
use crate::ops::ratio_shadow::RatioShadow;
use crate::ops::{duplicate, transform};
use crate::{EditState, Similarity};

/// Copies make no more than so many: about 10 GiB of memory with colors of degree 3. Copies of copies would fill any machine.
const MAX_GAUSSIANS: usize = 20_000_000;

/// Refuses to move matter out of what a file can hold.
pub(super) fn within_range(
    bounds: Option<Bounds>,
    at: &str,
    moved: impl Fn(DVec3) -> DVec3,
) -> Result<(), EditError> {
    let corners = bounds.iter().flat_map(|b| [b.min, b.max]);
    match corners.map(moved).find(|p| !(p.abs().max_element() <= LARGEST)) {
        None => Ok(()),
        Some(p) => Err(EditError::plan(at, format!("it would be at {p}"))
            .remedy("coordinates beyond 1e18 cannot be drawn")),
    }
}

impl Run<'_> {
    pub(super) fn transform(
        &mut self,
        op: &TransformOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, op.target.as_deref(), at)?;
        let rotation = rotation_of(op);
        let scale = op.scale.unwrap_or(1.0);
        let bounds = Bounds::of(&state.gaussians, rows.iter().copied());
        let about_pivot = rotation != DQuat::IDENTITY || scale != 1.0;
        let pivot = match op.pivot.unwrap_or_default() {
            _ if !about_pivot => DVec3::ZERO,
            PivotDocument::Point(p) => DVec3::from_array(p),
            PivotDocument::Named(PivotName::Origin) => DVec3::ZERO,
            PivotDocument::Named(PivotName::Centroid) => some_place(bounds, at)?.centroid,
            PivotDocument::Named(PivotName::Base) => extent_of(state, &rows, at)?.base(),
        };
        let shift = DVec3::from_array(op.translate.unwrap_or_default());
        let motion = Similarity::about(pivot, rotation, scale, shift);
        if motion.is_identity() {
            return skipped("nothing would move");
        }
        within_range(bounds, at, |p| motion.point(p))?;
        let mut shadow = None;
        let is_part = rows.len() < state.len();
        let from = if is_part { some_place(bounds, at)?.centroid } else { DVec3::ZERO };
        if is_part {
            state.vacate(&rows, op.fill);
            self.unlit(state, at, "shadows stay where they were");
            shadow = self.lift_shadow(state, &rows, at);
        }
        transform::transform(state, &rows, &motion);
        if let Some(shadow) = shadow {
            let moved = motion.point(from) - from;
            shadow.apply(&mut state.gaussians, moved, false, &rows);
        }
        applied(rows.len())
    }

    pub(super) fn duplicate(
        &mut self,
        op: &DuplicateOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, op.target.as_deref(), at)?;
        let copies = rows.len().saturating_mul(op.count as usize);
        if state.len().saturating_add(copies) > MAX_GAUSSIANS {
            let cause = format!(
                "{copies} copies and {} are more than {MAX_GAUSSIANS} Gaussians",
                state.len()
            );
            return Err(EditError::plan(format!("{at}/count"), cause)
                .remedy("copy less, or merge files that are written one by one"));
        }
        let step = DVec3::from_array(op.translate);
        let bounds = Bounds::of(&state.gaussians, rows.iter().copied());
        within_range(bounds, at, |p| p + step * op.count as f64)?;
        let shadow = self.ratio_shadow.then(|| RatioShadow::read(state, &rows)).flatten();
        let selection = duplicate::duplicate(state, &rows, step, op.count as usize);
        let copied = selection.rows();
        for k in 1..=op.count {
            if let Some(shadow) = &shadow {
                shadow.apply(&mut state.gaussians, step * k as f64, false, &copied);
            }
        }
        keep(state, op.name.as_deref(), selection);
        self.unlit(state, at, "the copies cast no shadow");
        applied(copies)
    }
}
