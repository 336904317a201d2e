//! What can be checked before any Gaussian is read.

use std::path::{Path, PathBuf};

use crate::changes::materials::{material_named, material_names};
use crate::ops::OpDocument;
use crate::plan::{EditPlanDocument, Prepared, op_pointer};
use crate::run::{EditError, Editors};

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
        for (key, name) in op.clone().files() {
            if !folder.join(&*name).exists() {
                let cause = format!("no such file or folder: {}", folder.join(&*name).display());
                return Err(EditError::plan(format!("{at}{key}"), cause)
                    .remedy("files are named relative to the plan"));
            }
            let full = std::fs::canonicalize(folder.join(&*name)).unwrap_or_default();
            if let Some(output) = written.iter().find(|output| full.starts_with(output)) {
                let cause = format!("it would read what it writes: {}", output.display());
                return Err(EditError::plan(format!("{at}{key}"), cause)
                    .remedy("write to another place, or run it on a copy"));
            }
        }
        if let Some((key, name)) = op.material()
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
        editors.starts(plan.ops[i].program(), &op_pointer(i))?;
    }
    Ok(Prepared { effective, undone })
}
