//! What a fit leaves on its way: PLY files of the model so far, and curves for TensorBoard.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use motes_formats::event_file::EventFile;
use motes_formats::ply::{PlyWriteOptions, write_gaussians};
use motes_formats::train_report::TrainingPoint;
use motes_scene::Gaussians;
use motes_stage::{Context, StageError};

/// Digits of a step in a name, so that names sort by step.
const STEP_DIGITS: usize = 6;

/// PLY files of the model every so many steps.
pub(super) struct Snapshots {
    every: u32,
    output: PathBuf,
    options: PlyWriteOptions,
    /// By step.
    written: BTreeSet<PathBuf>,
    /// How many are there at a time, none after the fit; None: all stay.
    most: Option<usize>,
}

impl Snapshots {
    /// Beside the product, every `every` steps after step `from`.
    ///
    /// # Errors
    /// [`StageError::Usage`] when a snapshot of a later step is there already and may not be replaced.
    pub(super) fn new(
        every: u32,
        output: &Path,
        options: PlyWriteOptions,
        from: u32,
        overwrite: bool,
    ) -> Result<Self, StageError> {
        let old = existing(output).into_iter().find(|(step, _)| *step > from);
        match old {
            Some((_, path)) if !overwrite => {
                let text = format!("output exists already: {}", path.display());
                Err(StageError::usage(text).help("choose another path or pass --overwrite"))
            }
            _ => {
                let output = output.to_owned();
                Ok(Self {
                    every: every.max(1),
                    output,
                    options,
                    written: BTreeSet::new(),
                    most: None,
                })
            }
        }
    }

    /// For somebody who looks at the fit: none stays after it, and two on the way, since one may be read while the next is written.
    pub(super) fn for_a_look(mut self) -> Self {
        self.most = Some(2);
        self
    }

    /// Whether one is due after this step.
    pub(super) fn is_due(&self, step: u32) -> bool {
        step.is_multiple_of(self.every)
    }

    /// Writes the model of a step, in the world of the capture.
    ///
    /// # Errors
    /// When a value is not finite or the file cannot be written.
    pub(super) fn write(
        &mut self,
        step: u32,
        model: &Gaussians,
        context: &Context,
    ) -> anyhow::Result<()> {
        let path = path_of(&self.output, step);
        if self.written.insert(path.clone()) {
            context.output(&path)?;
        }
        write_gaussians(&path, model, &self.options)?;
        while self.most.is_some_and(|most| self.written.len() > most)
            && let Some(old) = self.written.pop_first()
        {
            remove(&old);
        }
        Ok(())
    }

    /// Takes away what a start left that has failed: the fit begins again.
    pub(super) fn forget(&self) {
        self.written.iter().for_each(|path| remove(path));
    }
}

impl Drop for Snapshots {
    fn drop(&mut self) {
        if self.most.is_some() {
            self.forget();
        }
    }
}

fn remove(path: &Path) {
    // One that is gone already is what is wanted.
    let _ = std::fs::remove_file(path);
}

/// `gaussians.ply` after 500 steps → `gaussians.step-000500.ply`.
fn path_of(output: &Path, step: u32) -> PathBuf {
    output.with_extension(format!("step-{step:0STEP_DIGITS$}.ply"))
}

/// Snapshots of a product that are there, by step.
fn existing(output: &Path) -> Vec<(u32, PathBuf)> {
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).into_iter().flatten();
    let stem = output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut found: Vec<(u32, PathBuf)> = entries
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            let name = path.file_name()?.to_str()?.strip_prefix(&stem)?;
            let step = name.strip_prefix(".step-")?.strip_suffix(".ply")?.parse().ok()?;
            Some((step, path))
        })
        .collect();
    found.sort();
    found
}

/// A row of the training curve as scalars of TensorBoard.
///
/// # Errors
/// When the file cannot be written.
pub(super) fn log_point(events: &mut EventFile, row: &TrainingPoint) -> anyhow::Result<()> {
    let mut scalars = vec![("loss/train", row.loss), ("gaussians", row.gaussians as f64)];
    scalars.extend(row.psnr_test.map(|psnr| ("psnr/test", psnr)));
    Ok(events.scalars(row.step.into(), &scalars)?)
}

/// The scores of the finished model, dB.
///
/// # Errors
/// When the file cannot be written.
pub(super) fn log_scores(
    events: &mut EventFile,
    step: u32,
    train: Option<f64>,
    test: Option<f64>,
) -> anyhow::Result<()> {
    let named = [("psnr/train", train), ("psnr/test", test)];
    let scalars: Vec<(&str, f64)> =
        named.into_iter().filter_map(|(tag, psnr)| Some((tag, psnr?))).collect();
    Ok(events.scalars(step.into(), &scalars)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_sort_by_step_and_are_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("g.ply");
        for name in ["g.step-000500.ply", "g.step-001000.ply", "other.step-000700.ply", "g.ply"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(path_of(&output, 500), folder.path().join("g.step-000500.ply"));
        let steps: Vec<u32> = existing(&output).into_iter().map(|(step, _)| step).collect();
        assert_eq!(steps, [500, 1000]);
        let new = |from, overwrite| {
            Snapshots::new(500, &output, PlyWriteOptions::default(), from, overwrite)
        };
        assert!(new(0, false).is_err() && new(0, true).is_ok());
        assert!(new(1000, false).is_ok(), "a resumed fit goes on behind them");
    }
}
