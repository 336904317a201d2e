//! What an edit writes.

use std::path::{Path, PathBuf};

use crate::plan::EditPlanDocument;
use motes_codecs::{SplatFormat, SplatWriteOptions};
use motes_formats::decomposition::SCENE_FILES;
use motes_formats::ply::{PlyWriteOptions, write_gaussians, write_gaussians_to};
use motes_scene::{Gaussians, Surface};
use motes_stage::{Context, StageError};

use super::input::Input;
use super::output::{log_path, write_log, write_scene};

/// The path that stands for standard output.
const STANDARD_OUTPUT: &str = "-";

/// What will be written.
pub(super) struct Outputs {
    /// The splat or scene folder.
    pub(super) output: PathBuf,
    /// Format of the splat.
    format: SplatFormat,
    /// The plan as executed; none beside standard output.
    pub(super) log: Option<PathBuf>,
    /// Folder of pictures.
    pub(super) thumbnails: Option<PathBuf>,
}

impl Outputs {
    /// Claims the outputs of an edit of a scene, or of the splat `gaussians`.
    ///
    /// # Errors
    /// When one is taken, or the suffix of an edited splat names no format.
    pub(super) fn claim(
        output: &Path,
        thumbnails: Option<&Path>,
        is_scene: bool,
        context: &Context,
    ) -> anyhow::Result<Self> {
        let format = if is_scene { SplatFormat::Ply } else { format_of(output)? };
        let output = context.output(output)?;
        if is_scene {
            context.output_files(&output, &SCENE_FILES)?;
        }
        let log = log_path(&output, is_scene);
        let log = match (is_scene, output == Path::new(STANDARD_OUTPUT)) {
            (true, _) => Some(log),
            (false, true) => None,
            (false, false) => Some(context.output(log)?),
        };
        let thumbnails = thumbnails.map(|folder| context.output(folder)).transpose()?;
        Ok(Self { output, format, log, thumbnails })
    }

    pub(super) fn paths(&self) -> Vec<&Path> {
        [&self.output]
            .into_iter()
            .chain(&self.log)
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
        context: &Context,
    ) -> anyhow::Result<()> {
        match (&input.decomposition, &input.state.parts) {
            (Some(decomposition), Some(parts)) => {
                let (document, options) = (&decomposition.document, &input.write_options);
                write_scene(&self.output, &input.state, parts, surface, document, options, executed)
            }
            _ => {
                self.write_splat(&input.state.gaussians, &input.write_options, context)?;
                self.log.as_ref().map_or(Ok(()), |log| write_log(log, executed))
            }
        }
    }

    fn write_splat(
        &self,
        gaussians: &Gaussians,
        options: &PlyWriteOptions,
        context: &Context,
    ) -> anyhow::Result<()> {
        if self.output == Path::new(STANDARD_OUTPUT) {
            let mut stdout = context.stdout();
            write_gaussians_to(&mut stdout, gaussians, options, &self.output)?;
            return Ok(std::io::Write::flush(&mut stdout)?);
        }
        if self.format == SplatFormat::Ply {
            return Ok(write_gaussians(&self.output, gaussians, options)?);
        }
        let codec = self.format.codec();
        if gaussians.sh_degree > codec.max_sh_degree || !codec.lossless {
            context.warn(format!("the format {} rounds: {}", codec.name, codec.loses));
        }
        let options = SplatWriteOptions {
            render_mode: options.render_mode,
            exposure_response: options.exposure_response,
            comments: options.comments.clone(),
            ..SplatWriteOptions::default()
        };
        Ok(motes_codecs::write_gaussians(&self.output, self.format, gaussians, &options)?)
    }
}

/// The format of Gaussians that the suffix names: one that can be read again. Standard output takes PLY.
fn format_of(output: &Path) -> Result<SplatFormat, StageError> {
    if output == Path::new(STANDARD_OUTPUT) {
        return Ok(SplatFormat::Ply);
    }
    let is_splat = |format: &SplatFormat| {
        let codec = format.codec();
        codec.is_readable() && codec.is_writable()
    };
    SplatFormat::of_name(output).filter(is_splat).ok_or_else(|| {
        let all = SplatFormat::ALL.iter().filter(|format| is_splat(format));
        let suffixes: Vec<&str> = all.flat_map(|f| f.codec().suffixes).copied().collect();
        let text = format!("the suffix names no format of Gaussians: {}", output.display());
        let help = format!("take one of {}; a scene folder needs --scene", suffixes.join(", "));
        StageError::usage(text).help(help)
    })
}
