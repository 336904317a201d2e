//! The steps of a `select` operation.

use motes_formats::edit_plan::{OpDocument, SelectOp};
use motes_formats::selection::read_selection;
use motes_formats::selectors::{SelectStep, Selector};
use motes_scene::Selection;
use segment_select::{SelectSource, select_from};

use super::prepare::absolute;
use super::{EditError, Resources};
use crate::{EditState, Origin, SCENE};

/// The selection that the steps arrive at.
pub(super) fn select(
    state: &EditState,
    op: &SelectOp,
    resources: &Resources<'_>,
    at: &str,
) -> Result<Selection, EditError> {
    // Masks are read by the interpreter, which knows no folder of the plan.
    let OpDocument::Select(op) = &absolute(&OpDocument::Select(op.clone()), resources.folder)
    else {
        return Ok(Selection::none(state.len()));
    };
    let from = op.from.as_ref().or(state.current.as_ref());
    let start = match from.map(String::as_str) {
        Some("all") => Some(Selection::all(state.len())),
        name => name.and_then(|name| state.selections.get(name)).cloned(),
    };
    let mut selection = start.unwrap_or_else(|| Selection::none(state.len()));
    let mut source = SelectSource::new(&state.gaussians, resources.antialias);
    if let Some((capture, path)) = resources.capture {
        source = source.with_capture(capture, path);
    }
    for (i, step) in op.steps.iter().enumerate() {
        let at = format!("{at}/steps/{i}");
        let own = match step {
            SelectStep::Select(step) => own_selector(state, &step.selector, resources, &at)?
                .map(|found| selection.combined(step.combine, &found)),
            SelectStep::Post(_) => None,
        };
        selection = match own {
            Some(selection) => selection,
            None => {
                select_from(&source, selection, std::slice::from_ref(step)).map_err(|error| {
                    let text = error.to_string();
                    let (cause, remedy) = text.split_once("\nhelp: ").unwrap_or((&text, ""));
                    match remedy {
                        "" => EditError::plan(&at, cause),
                        remedy => EditError::plan(&at, cause).remedy(remedy),
                    }
                })?
            }
        };
    }
    Ok(selection)
}

/// Selectors whose meaning depends on the history of the rows: files and rows.
fn own_selector(
    state: &EditState,
    selector: &Selector,
    resources: &Resources<'_>,
    at: &str,
) -> Result<Option<Selection>, EditError> {
    match selector {
        Selector::Ids { ids } => match ids.iter().find(|row| **row as usize >= state.len()) {
            None => Ok(None),
            Some(row) => {
                let cause = format!("row {row} of {} Gaussians does not exist", state.len());
                Err(EditError::plan(format!("{at}/ids"), cause))
            }
        },
        Selector::File { path } => {
            let failed = EditError::file(at);
            let bound = (resources.bound)().map_err(&failed)?;
            let file = read_selection(&resources.file(path), &bound).map_err(&failed)?;
            Ok(Some(of_source(state, &file.selection)))
        }
        _ => Ok(None),
    }
}

/// A selection of the rows of the scene as it was read, on the Gaussians that are there now.
fn of_source(state: &EditState, of_scene: &Selection) -> Selection {
    let confidence = |origin: &Origin| match origin.source {
        SCENE => of_scene.confidence.get(origin.row as usize).copied().unwrap_or(0.0),
        _ => 0.0,
    };
    Selection { confidence: state.origins.iter().map(confidence).collect() }
}
