//! Names of the card to names of files.

use std::path::{Component, Path, PathBuf};

use edit::ops::OpDocument;
use edit::plan::EditPlanDocument;
use motes_stage::StageError;

use super::assets::is_below;
use super::inputs::Inputs;

/// Where the files of a card lie.
pub(super) struct Names<'a> {
    pub(super) inputs: &'a Inputs,
}

impl Names<'_> {
    /// The plan with its files named relative to `folder`.
    ///
    /// # Errors
    /// A file is not below the folder that it belongs to, or its name is not Unicode.
    pub(super) fn resolved(
        &self,
        plan: &EditPlanDocument,
        folder: &Path,
    ) -> Result<EditPlanDocument, StageError> {
        let mut plan = plan.clone();
        for op in &mut plan.ops {
            let labels = self.inputs.labels.as_deref().map(parent);
            let home = match op {
                OpDocument::Select(_) => labels,
                _ => self.inputs.assets_folder.clone(),
            };
            for (_, name) in op.files() {
                let home = home.clone().unwrap_or_default();
                let file = home.join(&*name);
                let outside = || {
                    StageError::bad_input(format!(
                        "{} lies outside {}",
                        file.display(),
                        home.display()
                    ))
                };
                if !is_below(&file, &home) {
                    return Err(outside());
                }
                *name = relative(&file, folder).ok_or_else(outside)?;
            }
        }
        Ok(plan)
    }
}

fn parent(file: &Path) -> PathBuf {
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty());
    folder.unwrap_or(Path::new(".")).to_owned()
}

/// `file` as seen from `folder`, with `/` between its parts; none when one of them is not there or not Unicode.
fn relative(file: &Path, folder: &Path) -> Option<String> {
    let (file, folder) = (file.canonicalize().ok()?, folder.canonicalize().ok()?);
    let (to, from): (Vec<Component<'_>>, Vec<Component<'_>>) =
        (file.components().collect(), folder.components().collect());
    let same = to.iter().zip(&from).take_while(|(a, b)| a == b).count();
    let mut parts = vec![".."; from.len() - same];
    for part in &to[same..] {
        parts.push(part.as_os_str().to_str()?);
    }
    Some(parts.join("/"))
}
