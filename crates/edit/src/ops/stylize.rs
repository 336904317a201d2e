//! Views edited by a program, and a fit to them.

use motes_scene::Split;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::files::editor::Editor;
use crate::run::{
    EditError, Fault, MAX_FIT_STEPS, Outcome, Program, Resources, Run, bounded, rows_of, skipped,
};
use crate::stylize::{EditorError, PictureEditor, StyleError, StyleOptions, StyleView, stylize};

/// Edit pictures of the scene with an external program and fit the Gaussians to them
/// (the loop of Instruct-NeRF2NeRF, Haque et al. 2023). Needs a capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StylizeOp {
    /// What may change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Passed to the editor.
    #[serde(default)]
    pub prompt: String,
    /// Command line: `{input}`, `{output}` and `{prompt}` are replaced by the rendered picture, the picture to write and the
    /// prompt. It is run without a shell. Without it the provider of the command line edits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub editor: Option<String>,
    /// Training views that are edited, evenly spread; 0: all.
    #[serde(default = "eight")]
    pub views: u32,
    /// Views that are edited first and warped to the others by depth; 0: every view is edited on its own.
    #[serde(default = "three_views")]
    pub key_views: u32,
    /// How often all views are edited again.
    #[serde(default = "two")]
    #[schemars(range(min = 1, max = 100))]
    pub rounds: u32,
    /// Steps of the fit in each round.
    #[serde(default = "steps")]
    #[schemars(range(min = 1, max = 100_000))]
    pub steps: u32,
    /// Weight views by how far they agree with the others.
    #[serde(default = "yes")]
    pub weigh: bool,
}

impl Operation for StylizeOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "stylize",
        Short::Text("prompt"),
        "PROMPT",
        "Edit views with --provider or the program of --editor and fit the scene to them",
    )];
    const SHARED: &'static [&'static str] = &["editor"];

    fn check(&self) -> Result<(), Fault> {
        for word in ["{input}", "{output}"] {
            if self.editor.as_ref().is_some_and(|editor| !editor.contains(word)) {
                let cause = format!("the command has no {word}");
                let remedy = "for example: python3 edit.py {input} {output} {prompt}";
                return Err(("/editor".into(), cause, Some(remedy.into())));
            }
        }
        bounded("/rounds", u64::from(self.rounds), 100)?;
        bounded("/steps", u64::from(self.steps), u64::from(MAX_FIT_STEPS))
    }

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
    }

    fn program(&self) -> Program<'_> {
        self.editor.as_deref().map_or(Program::Provider, Program::Command)
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, self.target.as_deref(), at)?;
        if !run.resources.editors.starts(self.program(), at)? {
            return skipped("a dry run starts no program");
        }
        let numbers = apply_style(state, &rows, self, run.seed, run.resources, at)?;
        if state.parts.is_some() {
            run.warn(at, "colors changed, base colors did not: relighting shows the old ones");
        }
        Ok(Outcome::Applied(rows.len() as u64, numbers))
    }
}

fn eight() -> u32 {
    8
}

fn three_views() -> u32 {
    3
}

fn two() -> u32 {
    2
}

fn steps() -> u32 {
    200
}

fn yes() -> bool {
    true
}

/// Fits the Gaussians of `rows` to pictures that a program edited; the numbers of the report, by name.
fn apply_style(
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
    let broken = |error: EditorError| EditError::plan(format!("{at}/editor"), error.to_string());
    let program = op.editor.as_deref().map(Editor::new).transpose().map_err(broken)?;
    let editor: &dyn PictureEditor = match (&program, resources.editors.provider) {
        (Some(program), _) => program,
        (None, Some(provider)) => provider,
        (None, None) => return Err(EditError::plan(at, "nothing edits the pictures")),
    };
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
        editor,
        &op.prompt,
        &options,
        resources.stopped,
    )
    .map_err(|error| edit_error(error, at))?;
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

/// What went wrong, at the place in the plan that it concerns.
fn edit_error(error: StyleError, at: &str) -> EditError {
    match error {
        StyleError::Stopped => EditError::Stopped,
        StyleError::Editor(EditorError::Picture(source)) => {
            EditError::file(&format!("{at}/editor"))(source)
        }
        StyleError::Editor(EditorError::Provider(error)) => {
            let text = error.to_string();
            match text.split_once("\nhelp: ") {
                Some((cause, remedy)) => EditError::plan(at, cause).remedy(remedy),
                None => EditError::plan(at, text),
            }
        }
        StyleError::Editor(error) => EditError::plan(format!("{at}/editor"), error.to_string()),
        StyleError::Fit(error) => EditError::plan(at, error.to_string()),
    }
}
