//! The steps of a `select` operation.

use glam::{DQuat, DVec3};
use motes_formats::edit_plan::SelectOp;
use motes_formats::selection::read_selection;
use motes_formats::selectors::{PostDocument, SelectStep, Selector};
use motes_scene::Selection;

use super::{EditError, Resources};
use crate::{EditState, SCENE};

/// The selection that the steps arrive at.
pub(super) fn select(
    state: &EditState,
    op: &SelectOp,
    resources: &Resources<'_>,
    at: &str,
) -> Result<Selection, EditError> {
    let from = op.from.as_ref().or(state.current.as_ref());
    let start = match from.map(String::as_str) {
        Some("all") => Some(Selection::all(state.len())),
        name => name.and_then(|name| state.selections.get(name)).cloned(),
    };
    let mut selection = start.unwrap_or_else(|| Selection::none(state.len()));
    for (i, step) in op.steps.iter().enumerate() {
        let at = format!("{at}/steps/{i}");
        selection = match step {
            SelectStep::Post(PostDocument::Invert) => selection.inverted(),
            SelectStep::Post(_) => return Err(unknown(&at)),
            SelectStep::Select(step) => {
                let found = find(state, &step.selector, resources, &at)?;
                selection.combined(step.combine.into(), &found)
            }
        };
    }
    Ok(selection)
}

fn unknown(at: &str) -> EditError {
    EditError::plan(at, "this selector needs pictures of the scene")
        .remedy("select with segment-select and name its selection.json: {\"by\": \"file\", ...}")
}

fn find(
    state: &EditState,
    selector: &Selector,
    resources: &Resources<'_>,
    at: &str,
) -> Result<Selection, EditError> {
    let n = state.len();
    let point = |i: usize| DVec3::from_array(state.gaussians.means[i].map(f64::from));
    Ok(match selector {
        Selector::All => Selection::all(n),
        Selector::Sphere { center, radius } => {
            let center = DVec3::from_array(*center);
            Selection::where_true(n, |i| point(i).distance(center) <= *radius)
        }
        Selector::Box { center, half_size, rotation: [w, x, y, z] } => {
            let (center, half) = (DVec3::from_array(*center), DVec3::from_array(*half_size));
            let box_from_world = DQuat::from_xyzw(*x, *y, *z, *w).normalize().conjugate();
            Selection::where_true(n, |i| {
                (box_from_world * (point(i) - center)).abs().cmple(half).all()
            })
        }
        Selector::HalfSpace { normal, point: on } => {
            let (normal, on) = (DVec3::from_array(*normal), DVec3::from_array(*on));
            Selection::where_true(n, |i| (point(i) - on).dot(normal) >= 0.0)
        }
        Selector::Ids { ids } => {
            if let Some(row) = ids.iter().find(|row| **row as usize >= n) {
                let cause = format!("row {row} of {n} Gaussians does not exist");
                return Err(EditError::plan(format!("{at}/ids"), cause));
            }
            let mut chosen = vec![false; n];
            ids.iter().for_each(|row| chosen[*row as usize] = true);
            Selection::where_true(n, |i| chosen[i])
        }
        Selector::File { path } => {
            let failed = EditError::file(at);
            let bound = (resources.bound)().map_err(&failed)?;
            let file = read_selection(&resources.file(path), &bound).map_err(&failed)?;
            of_source(state, &file.selection)
        }
        _ => return Err(unknown(at)),
    })
}

/// A selection of the rows of the scene as it was read, on the Gaussians that are there now.
fn of_source(state: &EditState, of_scene: &Selection) -> Selection {
    let confidence = |origin: &crate::Origin| match origin.source {
        SCENE => of_scene.confidence.get(origin.row as usize).copied().unwrap_or(0.0),
        _ => 0.0,
    };
    Selection { confidence: state.origins.iter().map(confidence).collect() }
}
