//! Choosing Gaussians.

use motes_formats::documents::brief;
use motes_formats::selectors::{PostDocument, SelectStep, Selector, SelectorStep};
use motes_scene::Selection;
use schemars::JsonSchema;
use segment_select::{SelectSource, select_from};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::operation::{Flag, Operation, Short};
use crate::run::{EditError, Fault, Outcome, Resources, Run, applied, check_steps, keep};
use crate::{EditState, Origin, SCENE};

/// Choose Gaussians, and give the choice a name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SelectOp {
    /// Name for later operations. Without one the choice can be used until the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// The selection that the steps start from. Default: the one made last, none before the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// What `segment-select` takes: selectors (`by`), each combined with what was chosen before it (`combine`: `set`,
    /// `add`, `subtract`, `intersect`), and changes of the choice (`post`).
    #[schemars(length(min = 1))]
    pub steps: Vec<SelectStep>,
}

impl Operation for SelectOp {
    const FLAGS: &'static [Flag] = &[
        Flag::of(
            "selection",
            Short::SelectionFile,
            "FILE",
            "Select the Gaussians of a selection.json",
        ),
        Flag::of(
            "select",
            Short::Step,
            "STEP",
            "Select with a step of segment-select, [COMBINE:]KIND[=VALUES], or JSON",
        ),
    ];

    fn check(&self) -> Result<(), Fault> {
        check_steps(&self.steps)
    }

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.from.as_deref().map(|from| ("from", from))
    }

    fn defines(&self) -> Option<(&'static str, &str)> {
        self.id.as_deref().map(|id| ("id", id))
    }

    fn files(&mut self) -> Vec<(String, &mut String)> {
        let mut files = Vec::new();
        for (i, step) in self.steps.iter_mut().enumerate() {
            let SelectStep::Select(step) = step else { continue };
            match &mut step.selector {
                Selector::File { path } => files.push((format!("/steps/{i}/path"), path)),
                Selector::Masks { masks } => {
                    let masks = masks.iter_mut().enumerate();
                    files.extend(
                        masks.map(|(k, m)| (format!("/steps/{i}/masks/{k}/path"), &mut m.path)),
                    );
                }
                _ => {}
            }
        }
        files
    }

    /// What is wrong with the first broken step: the union of both kinds of steps only says that it is neither.
    fn mistake(keys: &Map<String, Value>) -> Option<String> {
        let mut steps = keys.get("steps")?.as_array()?.iter();
        let broken =
            steps.find(|step| serde_json::from_value::<SelectStep>((*step).clone()).is_err())?;
        let error = match broken.get("post") {
            Some(_) => serde_json::from_value::<PostDocument>(broken.clone()).err()?,
            None => serde_json::from_value::<SelectorStep>(broken.clone()).err()?,
        };
        Some(brief(&error))
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let selection = select(state, self, run.resources, at)?;
        let count = selection.count();
        if count == 0 {
            return Err(EditError::plan(format!("{at}/steps"), "the selection is empty"));
        }
        keep(state, self.id.as_deref(), selection);
        applied(count)
    }
}

/// The selection that the steps arrive at.
fn select(
    state: &EditState,
    op: &SelectOp,
    resources: &Resources<'_>,
    at: &str,
) -> Result<Selection, EditError> {
    // Masks are read by the interpreter, which knows no folder of the plan.
    let mut op = op.clone();
    op.files().into_iter().for_each(|(_, name)| *name = resources.absolute(name));
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
            let selection = resources.selection(path).map_err(EditError::file(at))?;
            Ok(Some(of_source(state, &selection)))
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
