//! Operations that take Gaussians away.

use glam::DVec3;
use motes_formats::edit_plan::{
    CropOp, DecimateOp, DeleteOp, ExtractOp, KeepDocument, KeepLargestOp, RemoveFloatersOp,
};

use super::EditError;
use super::apply::{Outcome, Run, applied, skipped};
use super::values::rows_of;
use crate::ops::{clusters, decimate, delete, floaters};
use crate::{EditState, Fill};

impl Run<'_> {
    pub(super) fn delete(
        &mut self,
        op: &DeleteOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        if op.target.is_none() && state.current.is_none() {
            return Err(EditError::plan(format!("{at}/target"), "nothing was selected")
                .remedy("select first: a whole scene is not deleted by leaving something out"));
        }
        let rows = rows_of(state, op.target.as_deref(), at)?;
        self.lift_shadow(state, &rows, at);
        delete::delete(state, &rows, op.fill);
        self.unlit(state, at, "the place that was uncovered stays open and keeps its old light");
        applied(rows.len())
    }

    pub(super) fn decimate(
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
            self.warn(at, format!("{left} are left: the others have values that are not numbers"));
        }
        applied(rows.len() - left)
    }
}

/// Everything but a target goes.
pub(super) fn extract(
    op: &ExtractOp,
    state: &mut EditState,
    at: &str,
) -> Result<Outcome, EditError> {
    let rows = rows_of(state, op.target.as_deref(), at)?;
    let others = delete::other_rows(&rows, state.len());
    state.remove(&others, Fill::None);
    applied(rows.len())
}

pub(super) fn crop(op: &CropOp, state: &mut EditState, at: &str) -> Result<Outcome, EditError> {
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
    remove_found(state, &gone, "nothing lies on the side that goes")
}

pub(super) fn remove_floaters(
    op: &RemoveFloatersOp,
    state: &mut EditState,
    at: &str,
) -> Result<Outcome, EditError> {
    let rows = rows_of(state, op.target.as_deref(), at)?;
    let found = floaters::floaters(state, &rows, op.neighbors as usize, op.deviations);
    remove_found(state, &found, "nothing hangs far from the others")
}

pub(super) fn keep_largest(
    op: &KeepLargestOp,
    state: &mut EditState,
    at: &str,
) -> Result<Outcome, EditError> {
    let rows = rows_of(state, op.target.as_deref(), at)?;
    let found = clusters::outside_largest(state, &rows, op.reach);
    remove_found(state, &found, "all of it is one cluster")
}

fn remove_found(state: &mut EditState, rows: &[u32], none: &str) -> Result<Outcome, EditError> {
    if rows.is_empty() {
        return skipped(none);
    }
    state.remove(rows, Fill::None);
    applied(rows.len())
}
