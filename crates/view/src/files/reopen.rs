//! A plan that was saved before, to go on with.

use std::path::{Path, PathBuf};

use edit::files::{Reach, prepare, read_edit_plan};
use edit::ops::OpDocument;
use edit::plan::EditPlanDocument;
use edit::run::{EditError, Editors};
use motes_formats::FormatError;
use motes_stage::Context;

use super::named::{Named, absolute};

/// A plan without its operations, and the operations that an `undo` does not take back, with files by absolute path. Nothing is
/// started, and nothing is read outside of the folders of the plan, the scene and the assets.
///
/// # Errors
/// The plan cannot be read, does not fit, or reaches further.
pub(super) fn reopened(
    path: &Path,
    named: &Named<'_>,
    context: &Context,
) -> anyhow::Result<(EditPlanDocument, Vec<OpDocument>)> {
    context.input("plan", path)?;
    let parsed = read_edit_plan(path)?;
    parsed.warnings.iter().for_each(|text| context.warn(text));
    let mut plan = parsed.document;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let reach = Reach {
        folder,
        named: named.assets.iter().map(PathBuf::as_path).chain(named.scene).collect(),
        typed: 0,
        written: &[],
        editors: Editors { named: &[], provider: None, start: false },
    };
    let prepared = prepare(&plan, &reach).map_err(|error| misfit(error, path))?;
    if plan.refit_steps.is_some_and(|steps| steps > 0) {
        context.warn("the page does not fit fillings to the photos; edit does, by the plan");
    }
    let ops = std::mem::take(&mut plan.ops);
    let is_effective = |i: &usize| prepared.effective.contains(i);
    let kept = ops.into_iter().enumerate().filter(|(i, _)| is_effective(i));
    let ops = kept.map(|(_, mut op)| {
        op.files().into_iter().for_each(|(_, name)| *name = absolute(&folder.join(&*name)));
        op
    });
    let ops = ops.collect();
    plan.record = None;
    Ok((plan, ops))
}

/// An operation that does not fit, as bad input with its place.
fn misfit(error: EditError, plan: &Path) -> FormatError {
    match error {
        EditError::Plan { at, cause, remedy } => {
            let error = FormatError::invalid(plan, at, cause);
            match remedy {
                Some(remedy) => error.with_remedy(remedy),
                None => error,
            }
        }
        error => FormatError::invalid(plan, "", error.to_string()),
    }
}
