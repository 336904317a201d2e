//! What is exported: files of Gaussians, or a scene folder.

use std::path::{Path, PathBuf};

use clap::Args;
use motes_codecs::{merge_gaussians, open_gaussians};
use motes_formats::decomposition::read_decomposition;
use motes_formats::ply::GaussianFile;
use motes_stage::{Context, StageError};
use serde::Serialize;

/// The flags that choose and trim the Gaussians.
#[derive(Args, Clone, Debug, Serialize)]
pub struct InputOptions {
    /// Gaussians in any format that can be read; several become one
    #[arg(value_name = "IN")]
    pub inputs: Vec<PathBuf>,

    /// Gaussians, the same as IN
    #[arg(long, value_name = "FILE", conflicts_with = "inputs")]
    pub gaussians: Option<PathBuf>,

    /// Scene folder, as decompose makes it
    #[arg(long, value_name = "DIR", conflicts_with_all = ["inputs", "gaussians"])]
    pub scene: Option<PathBuf>,

    /// Keep spherical harmonics up to this degree only
    #[arg(long, value_name = "DEGREE", value_parser = clap::value_parser!(u8).range(0..=4))]
    pub sh_degree: Option<u8>,

    /// Leave out Gaussians fainter than this opacity, 0 to 1
    #[arg(long, value_name = "OPACITY", default_value_t = 0.0)]
    pub min_opacity: f32,

    /// Leave out Gaussians with NaN or infinite values instead of refusing them
    #[arg(long)]
    pub drop_invalid: bool,
}

/// The Gaussians to export.
pub struct Source {
    /// All of them, trimmed.
    pub file: GaussianFile,
    /// Left out by `--drop-invalid`.
    pub dropped_invalid: usize,
    /// Left out by `--min-opacity`.
    pub dropped_faint: usize,
}

impl InputOptions {
    /// The files of Gaussians.
    ///
    /// # Errors
    /// When none was named, or the scene folder has no document.
    fn files(&self, context: &Context) -> anyhow::Result<Vec<PathBuf>> {
        if let Some(folder) = &self.scene {
            context.input("scene", folder)?;
            let scene = read_decomposition(folder)?;
            scene.warnings.iter().for_each(|text| context.warn(text));
            return Ok(vec![scene.gaussians]);
        }
        let files: Vec<PathBuf> = self.inputs.iter().chain(&self.gaussians).cloned().collect();
        if files.is_empty() {
            return Err(StageError::usage("nothing to export was named")
                .help("give files of Gaussians, --gaussians or --scene")
                .into());
        }
        for file in &files {
            context.input("gaussians", file)?;
        }
        Ok(files)
    }

    /// Reads, merges and trims.
    ///
    /// # Errors
    /// When a file cannot be read, has invalid rows, or nothing is left.
    pub fn load(&self, context: &Context) -> anyhow::Result<Source> {
        if !(0.0..=1.0).contains(&self.min_opacity) {
            return Err(StageError::usage("--min-opacity is an opacity from 0 to 1").into());
        }
        let files = self.files(context)?;
        let mut opened = Vec::new();
        let (mut dropped_invalid, mut dropped_faint) = (0, 0);
        for path in &files {
            let mut file = open_gaussians(path)?;
            dropped_invalid += self.check_rows(&mut file, path)?;
            dropped_faint += self.drop_faint(&mut file);
            opened.push(file);
        }
        let mut rest = opened.split_off(1);
        let mut file = opened.remove(0);
        if rest.iter().any(|other| other.render_mode != file.render_mode) {
            context.warn(
                "the inputs want to be drawn with different footprints; the first one's is kept",
            );
        }
        if !rest.is_empty() {
            let sets = std::iter::once(std::mem::take(&mut file.gaussians));
            let others = rest.iter_mut().map(|other| std::mem::take(&mut other.gaussians));
            file.gaussians = merge_gaussians(sets.chain(others).collect());
        }
        if let Some(degree) = self.sh_degree.filter(|degree| *degree < file.gaussians.sh_degree) {
            file.gaussians = file.gaussians.with_sh_degree(degree);
        }
        if file.gaussians.is_empty() {
            let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
            let text = format!("there are no Gaussians to export: {}", names.join(", "));
            return Err(StageError::bad_input(text).into());
        }
        // The writer says both in its own words.
        file.comments
            .retain(|text| !text.starts_with("motes format") && !text.starts_with("SH degree"));
        file.comments.retain(|text| {
            !text.starts_with("SplatRenderMode") && !text.starts_with("ExposureResponse")
        });
        Ok(Source { file, dropped_invalid, dropped_faint })
    }

    fn check_rows(&self, file: &mut GaussianFile, path: &Path) -> Result<usize, StageError> {
        let invalid = file.gaussians.invalid_rows();
        let Some(first) = invalid.first() else { return Ok(0) };
        if !self.drop_invalid {
            let text = format!(
                "{} of {} Gaussians have NaN, infinite values or a rotation of length 0, the first is number {first}: {}",
                invalid.len(),
                file.gaussians.len(),
                path.display()
            );
            return Err(StageError::bad_input(text).help("leave them out with --drop-invalid"));
        }
        let mut next = invalid.iter().peekable();
        let valid = (0..file.gaussians.len() as u32).filter(|row| next.next_if_eq(&row).is_none());
        file.gaussians.gather(&valid.collect::<Vec<u32>>());
        Ok(invalid.len())
    }

    fn drop_faint(&self, file: &mut GaussianFile) -> usize {
        if !(self.min_opacity > 0.0) {
            return 0;
        }
        let logit = (self.min_opacity / (1.0 - self.min_opacity)).ln();
        let before = file.gaussians.len();
        let logits = &file.gaussians.opacity_logits;
        let rows: Vec<u32> = (0..before as u32).filter(|i| logits[*i as usize] >= logit).collect();
        file.gaussians.gather(&rows);
        before - rows.len()
    }
}
