//! What can be checked before any Gaussian is read.

use std::path::{Path, PathBuf};

use motes_formats::edit_plan::{EditPlanDocument, OpDocument, op_pointer};
use motes_formats::selectors::{SelectStep, Selector};

use super::{EditError, Editors};
use crate::ops::materials::{material_named, material_names};

/// Which operations of a plan are applied.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Prepared {
    /// Indices, in order.
    pub effective: Vec<usize>,
    /// Operations that an `undo` takes back, and the index of that `undo`.
    pub undone: Vec<(usize, usize)>,
}

/// Finds what `undo` takes back, and checks that files and materials that the plan names are there. `written` are the
/// files and folders that the plan will be answered with, `editors` the programs that it may start.
///
/// # Errors
/// A file does not exist or is one that will be written, the library has no such material, or the user did not name
/// a program that the plan would start.
pub fn prepare(
    plan: &EditPlanDocument,
    folder: &Path,
    written: &[&Path],
    editors: Editors<'_>,
) -> Result<Prepared, EditError> {
    let written: Vec<PathBuf> =
        written.iter().filter_map(|path| std::fs::canonicalize(path).ok()).collect();
    let mut effective: Vec<usize> = Vec::new();
    let mut undone = Vec::new();
    for (i, op) in plan.ops.iter().enumerate() {
        let at = op_pointer(i);
        for (key, name) in files_of(op) {
            if !folder.join(&name).exists() {
                let cause = format!("no such file or folder: {}", folder.join(&name).display());
                return Err(EditError::plan(format!("{at}{key}"), cause)
                    .remedy("files are named relative to the plan"));
            }
            let full = std::fs::canonicalize(folder.join(&name)).unwrap_or_default();
            if let Some(output) = written.iter().find(|output| full.starts_with(output)) {
                let cause = format!("it would read what it writes: {}", output.display());
                return Err(EditError::plan(format!("{at}{key}"), cause)
                    .remedy("write to another place, or run it on a copy"));
            }
        }
        if let Some((key, name)) = material_of(op)
            && material_named(name).is_none()
        {
            return Err(EditError::plan(
                format!("{at}/{key}"),
                format!("there is no material \"{name}\""),
            )
            .remedy(format!("the materials are {}", material_names())));
        }
        match op {
            OpDocument::Undo(undo) => {
                let keep = effective.len().saturating_sub(undo.steps as usize);
                undone.extend(effective.drain(keep..).map(|taken| (taken, i)));
            }
            _ => effective.push(i),
        }
    }
    undone.sort_unstable();
    for &i in &effective {
        if let OpDocument::Stylize(op) = &plan.ops[i] {
            editors.starts(&op.editor, &op_pointer(i))?;
        }
    }
    Ok(Prepared { effective, undone })
}

/// Files that an operation reads, and the rest of the pointer to their names.
fn files_of(op: &OpDocument) -> Vec<(String, String)> {
    let of_step = |(i, step): (usize, &SelectStep)| -> Vec<(String, String)> {
        let SelectStep::Select(step) = step else { return Vec::new() };
        match &step.selector {
            Selector::File { path } => vec![(format!("/steps/{i}/path"), path.clone())],
            Selector::Masks { masks } => {
                let path = |(k, mask): (usize, &motes_formats::selectors::MaskPrompt)| {
                    (format!("/steps/{i}/masks/{k}/path"), mask.path.clone())
                };
                masks.iter().enumerate().map(path).collect()
            }
            _ => Vec::new(),
        }
    };
    match op {
        OpDocument::Select(op) => op.steps.iter().enumerate().flat_map(of_step).collect(),
        OpDocument::Insert(op) => vec![("/file".into(), op.file.clone())],
        OpDocument::Swap(op) => vec![("/file".into(), op.file.clone())],
        OpDocument::SetEnvironment(op) => vec![("/file".into(), op.file.clone())],
        _ => Vec::new(),
    }
}

fn material_of(op: &OpDocument) -> Option<(&'static str, &str)> {
    match op {
        OpDocument::SetMaterial(op) => op.name.as_deref().map(|name| ("name", name)),
        OpDocument::Insert(op) => op.material.as_deref().map(|name| ("material", name)),
        OpDocument::Swap(op) => op.material.as_deref().map(|name| ("material", name)),
        _ => None,
    }
}

/// The plan with every file named by its absolute path, so that it means the same from any folder.
pub(super) fn absolute(op: &OpDocument, folder: &Path) -> OpDocument {
    let path = |name: &mut String| {
        let joined = folder.join(&*name);
        let full = std::fs::canonicalize(&joined).unwrap_or(joined);
        *name = full.to_string_lossy().into_owned();
    };
    let mut op = op.clone();
    match &mut op {
        OpDocument::Select(op) => {
            for step in &mut op.steps {
                let SelectStep::Select(step) = step else { continue };
                match &mut step.selector {
                    Selector::File { path: name } => path(name),
                    Selector::Masks { masks } => masks.iter_mut().for_each(|m| path(&mut m.path)),
                    _ => {}
                }
            }
        }
        OpDocument::Insert(op) => path(&mut op.file),
        OpDocument::Swap(op) => path(&mut op.file),
        OpDocument::SetEnvironment(op) => path(&mut op.file),
        _ => {}
    }
    op
}
