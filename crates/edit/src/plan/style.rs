//! The operation `stylize`.

use std::collections::BTreeMap;

use motes_formats::edit_plan::StylizeOp;
use motes_scene::Split;

use super::{EditError, Resources};
use crate::EditState;
use crate::stylize::{Editor, EditorError, StyleError, StyleOptions, StyleView, stylize};

/// Fits the Gaussians of `rows` to pictures that a program edited; the numbers of the report, by name.
pub(super) fn apply_style(
    state: &mut EditState,
    rows: &[u32],
    op: &StylizeOp,
    seed: u64,
    resources: &Resources<'_>,
    at: &str,
) -> Result<BTreeMap<String, Option<f64>>, EditError> {
    let Some((capture, _)) = resources.capture else {
        return Err(EditError::plan(at, "pictures need cameras").remedy("give --capture"));
    };
    let train: Vec<usize> = capture
        .views_of(Split::Train)
        .into_iter()
        .filter(|i| capture.cameras[capture.views[*i].camera].as_pinhole().is_some())
        .collect();
    if train.is_empty() {
        return Err(EditError::plan(at, "the capture has no training views of a pinhole camera"));
    }
    let wanted = match op.views {
        0 => train.len(),
        n => train.len().min(n as usize),
    };
    let views: Vec<StyleView> = (0..wanted)
        .filter_map(|i| {
            let view = &capture.views[train[i * train.len() / wanted]];
            let camera = capture.cameras[view.camera].as_pinhole()?;
            let camera_from_world = view.camera_from_world;
            Some(StyleView { name: view.name.clone(), camera, camera_from_world })
        })
        .collect();
    let editor = Editor::new(&op.editor, &op.prompt)
        .map_err(|error| EditError::plan(format!("{at}/editor"), error.to_string()))?;
    let options = StyleOptions {
        key_views: op.key_views as usize,
        rounds: op.rounds,
        steps: op.steps,
        weigh: op.weigh,
        seed,
    };
    let mut chosen = vec![false; state.len()];
    rows.iter().for_each(|row| chosen[*row as usize] = true);
    let report = stylize(
        &mut state.gaussians,
        &chosen,
        resources.antialias,
        &views,
        &editor,
        &options,
        resources.stopped,
    )
    .map_err(|error| match error {
        StyleError::Stopped => EditError::Stopped,
        StyleError::Editor(EditorError::Picture(source)) => {
            EditError::file(&format!("{at}/editor"))(source)
        }
        StyleError::Editor(error) => EditError::plan(format!("{at}/editor"), error.to_string()),
        StyleError::Fit(error) => EditError::plan(at, error.to_string()),
    })?;
    let mut numbers = BTreeMap::new();
    for (what, values) in [
        ("disagreement_edited", &report.edited),
        ("disagreement_fitted_to", &report.fitted_to),
        ("residual", &report.residual),
    ] {
        let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        numbers.insert(what.to_owned(), Some(mean).filter(|v| v.is_finite()));
        for (view, value) in views.iter().zip(values) {
            let value = Some(*value).filter(|v| v.is_finite());
            numbers.insert(format!("{what}.{}", view.name), value);
        }
    }
    Ok(numbers)
}
