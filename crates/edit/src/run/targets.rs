//! Values of a plan as the operations take them, and the Gaussians that they are about.

use glam::DVec3;
use motes_scene::Selection;

use super::context::EditError;
use super::values::ColorModeDocument;
use super::{LARGEST, Outcome, applied, skipped};
use crate::changes::color::{ColorChange, ColorMode};
use crate::changes::measure::{Bounds, Extent};
use crate::{EditState, Fill};

/// Makes a selection the current one.
pub(crate) fn keep(state: &mut EditState, name: Option<&str>, selection: Selection) {
    state.keep_selection(name, selection);
}

/// The rows that an operation is about; never none.
pub(crate) fn rows_of(
    state: &EditState,
    target: Option<&str>,
    at: &str,
) -> Result<Vec<u32>, EditError> {
    let rows = match target.or(state.current.as_deref()) {
        None | Some("all") => (0..state.len() as u32).collect(),
        Some(name) => state.selections.get(name).map(Selection::rows).unwrap_or_default(),
    };
    if rows.is_empty() {
        let cause = match target {
            Some(name) => format!("the selection \"{name}\" is empty now"),
            None => "nothing is selected any more".to_owned(),
        };
        return Err(EditError::plan(format!("{at}/target"), cause)
            .remedy("what was selected is gone: select again"));
    }
    Ok(rows)
}

pub(crate) fn extent_of(state: &EditState, rows: &[u32], at: &str) -> Result<Extent, EditError> {
    some_place(Extent::of(&state.gaussians, rows, state.up_in_world), at)
}

/// What is known of the place of a target that must have one.
pub(crate) fn some_place<T>(found: Option<T>, at: &str) -> Result<T, EditError> {
    found.ok_or_else(|| {
        EditError::plan(format!("{at}/target"), "no center of the target is a number")
            .remedy("drop_nan comes first")
    })
}

pub(crate) fn flat(at: &str) -> EditError {
    EditError::plan(format!("{at}/file"), "it has no height, so it cannot be scaled to one")
        .remedy("give \"up\", or another \"fit\"")
}

pub(crate) fn color(mode: ColorModeDocument, rgb_linear: [f64; 3]) -> ColorChange {
    let mode = match mode {
        ColorModeDocument::Tint => ColorMode::Tint,
        ColorModeDocument::Gain => ColorMode::Gain,
        ColorModeDocument::Replace => ColorMode::Replace,
    };
    ColorChange { mode, rgb_linear: rgb_linear.map(|v| v as f32) }
}

/// Refuses to move matter out of what a file can hold.
pub(crate) fn within_range(
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

/// Removes rows that were found; `none` says why there are none.
pub(crate) fn remove_found(
    state: &mut EditState,
    rows: &[u32],
    none: &str,
) -> Result<Outcome, EditError> {
    if rows.is_empty() {
        return skipped(none);
    }
    state.remove(rows, Fill::None);
    applied(rows.len())
}
