//! Values of a plan as the operations take them.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3, EulerRot};
use motes_formats::edit_plan::{ColorModeDocument, TransformOp};
use motes_scene::Selection;

use super::EditError;
use super::apply::Outcome;
use crate::EditState;
use crate::ops::color::{ColorChange, ColorMode};
use crate::ops::measure::{Extent, mean_color_linear};

/// Key of selections without a name.
const UNNAMED: &str = "";

/// Makes a selection the current one; without a name it lives until the next.
pub(super) fn keep(state: &mut EditState, name: Option<&str>, selection: Selection) {
    let name = name.unwrap_or(UNNAMED).to_owned();
    state.selections.insert(name.clone(), selection);
    state.current = Some(name);
}

/// The rows that an operation is about; never none.
pub(super) fn rows_of(
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

pub(super) fn extent_of(state: &EditState, rows: &[u32], at: &str) -> Result<Extent, EditError> {
    some_place(Extent::of(&state.gaussians, rows, state.up_in_world), at)
}

/// What is known of the place of a target that must have one.
pub(super) fn some_place<T>(found: Option<T>, at: &str) -> Result<T, EditError> {
    found.ok_or_else(|| {
        EditError::plan(format!("{at}/target"), "no center of the target is a number")
            .remedy("drop_nan comes first")
    })
}

pub(super) fn flat(at: &str) -> EditError {
    EditError::plan(format!("{at}/file"), "it has no height, so it cannot be scaled to one")
        .remedy("give \"up\", or another \"fit\"")
}

pub(super) fn color(mode: ColorModeDocument, rgb_linear: [f64; 3]) -> ColorChange {
    let mode = match mode {
        ColorModeDocument::Tint => ColorMode::Tint,
        ColorModeDocument::Gain => ColorMode::Gain,
        ColorModeDocument::Replace => ColorMode::Replace,
    };
    ColorChange { mode, rgb_linear: rgb_linear.map(|v| v as f32) }
}

pub(super) fn rotation_of(op: &TransformOp) -> DQuat {
    if let Some(rotation) = &op.rotate_axis {
        let axis = DVec3::from_array(rotation.axis).normalize_or(DVec3::Z);
        return DQuat::from_axis_angle(axis, rotation.deg.to_radians());
    }
    if let Some([x, y, z]) = op.rotate_euler_deg.map(|e| e.map(f64::to_radians)) {
        // About the world's x first: the rightmost factor acts first.
        return DQuat::from_euler(EulerRot::ZYX, z, y, x);
    }
    match op.rotate_quaternion {
        Some([w, x, y, z]) => DQuat::from_xyzw(x, y, z, w).normalize(),
        None => DQuat::IDENTITY,
    }
}

pub(super) fn measure(
    state: &EditState,
    target: Option<&str>,
    at: &str,
) -> Result<Outcome, EditError> {
    let rows = rows_of(state, target, at)?;
    let mut numbers = BTreeMap::new();
    let mut put = |name: &str, value: f64| {
        numbers.insert(name.to_owned(), Some(value).filter(|v| v.is_finite()));
    };
    if let Some(extent) = Extent::of(&state.gaussians, &rows, state.up_in_world) {
        let base = extent.base();
        for (name, p) in [
            ("min", extent.min),
            ("max", extent.max),
            ("centroid", extent.centroid),
            ("base", base),
        ] {
            for (axis, value) in ["x", "y", "z"].into_iter().zip(p.to_array()) {
                put(&format!("{name}_{axis}"), value);
            }
        }
        put("height", extent.height());
        put("footprint", extent.footprint());
    }
    if let Some(color) = mean_color_linear(&state.gaussians, &rows) {
        for (channel, value) in ["r", "g", "b"].into_iter().zip(color) {
            put(&format!("mean_linear_{channel}"), value);
        }
    }
    Ok(Outcome::Applied(rows.len() as u64, numbers))
}
