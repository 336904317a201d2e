//! What can be checked before any Gaussian is read.

use std::path::{Path, PathBuf};

use crate::changes::materials::{material_named, material_names};
use crate::ops::OpDocument;
use crate::plan::{EditPlanDocument, Prepared, op_pointer};
use crate::run::{EditError, Editors};

/// What a plan may reach.
#[derive(Clone)]
pub struct Reach<'a> {
    /// Folder that names of files are relative to.
    pub folder: &'a Path,
    /// Folders that the user named: operations of a plan file read nothing outside of them and of `folder`.
    pub named: Vec<&'a Path>,
    /// Number of operations at the end that were flags: the user's own words.
    pub typed: usize,
    /// Files and folders that the plan will be answered with.
    pub written: &'a [&'a Path],
    /// Programs that it may start.
    pub editors: Editors<'a>,
}

/// Finds what `undo` takes back, and checks that files and materials that the plan names are there and within reach.
///
/// # Errors
/// A file does not exist, lies outside the folders that the user named or is one that will be written, the library has no
/// such material, or the user did not name a program that the plan would start.
pub fn prepare(plan: &EditPlanDocument, reach: &Reach<'_>) -> Result<Prepared, EditError> {
    let Reach { folder, typed, written, editors, .. } = *reach;
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
            if i + typed < plan.ops.len() && !within(&full, folder, &reach.named) {
                let cause =
                    format!("the file lies outside the folder of the plan: {}", full.display());
                let home = full.parent().unwrap_or(Path::new("/")).display();
                return Err(EditError::plan(format!("{at}{key}"), cause)
                    .remedy(format!("--assets {home} lets the plan read there, if you trust it")));
            }
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

/// Whether a canonical path is below one of the folders. Links are followed before, so that none leads out.
fn within(full: &Path, folder: &Path, named: &[&Path]) -> bool {
    let below = |root: &Path| std::fs::canonicalize(root).is_ok_and(|root| full.starts_with(root));
    below(folder) || named.iter().any(|root| below(root))
}
