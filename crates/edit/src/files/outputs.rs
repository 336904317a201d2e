//! What an edit writes.

use std::path::{Path, PathBuf};

use crate::plan::EditPlanDocument;
use motes_formats::decomposition::SCENE_FILES;
use motes_formats::ply::write_gaussians;
use motes_scene::Surface;
use motes_stage::{Context, StageError};

use super::input::Input;
use super::output::{log_path, write_log, write_scene};

/// What will be written.
pub(super) struct Outputs {
    /// The splat or scene folder.
    pub(super) output: PathBuf,
    /// The plan as executed.
    pub(super) log: PathBuf,
    /// Folder of pictures.
    pub(super) thumbnails: Option<PathBuf>,
}

impl Outputs {
    /// Claims the outputs of an edit of a scene, or of the splat `gaussians`.
    ///
    /// # Errors
    /// When one is taken, or an edited splat is not to be a PLY file.
    pub(super) fn claim(
        output: &Path,
        thumbnails: Option<&Path>,
        is_scene: bool,
        context: &Context,
    ) -> anyhow::Result<Self> {
        let is_ply = output.extension().is_some_and(|end| end.eq_ignore_ascii_case("ply"));
        if !is_scene && !is_ply {
            let text = format!("an edited splat is written as .ply: {}", output.display());
            let help = "export turns it into other formats; a scene folder needs --scene";
            return Err(StageError::usage(text).help(help).into());
        }
        let output = context.output(output)?;
        if is_scene {
            context.output_files(&output, &SCENE_FILES)?;
        }
        let log = log_path(&output, is_scene);
        let log = if is_scene { log } else { context.output(log)? };
        let thumbnails = thumbnails.map(|folder| context.output(folder)).transpose()?;
        Ok(Self { output, log, thumbnails })
    }

    pub(super) fn paths(&self) -> Vec<&Path> {
        [&self.output, &self.log]
            .into_iter()
            .chain(&self.thumbnails)
            .map(PathBuf::as_path)
            .collect()
    }

    /// Writes everything, the document of a scene last.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub(super) fn write(
        &self,
        input: &Input,
        surface: &Surface,
        executed: &EditPlanDocument,
    ) -> anyhow::Result<()> {
        match (&input.decomposition, &input.state.parts) {
            (Some(decomposition), Some(parts)) => {
                let (document, options) = (&decomposition.document, &input.write_options);
                write_scene(&self.output, &input.state, parts, surface, document, options, executed)
            }
            _ => {
                let gaussians = &input.state.gaussians;
                write_gaussians(&self.output, gaussians, &input.write_options)?;
                write_log(&self.log, executed)
            }
        }
    }
}
