//! What a fit starts from: photos, options, and a checkpoint or a model when there is one.

use std::path::Path;

use motes_fit::{FitError, FitOptions, FitState, Trainer, TrainingImage};
use motes_formats::capture::read_capture;
use motes_formats::ply::read_gaussians;
use motes_scene::{Gaussians, SparsePoints, Split};
use motes_stage::{Context, StageError};

use super::checkpoint::read_checkpoint;
use super::photos::{load_training_images, sha256_of};

/// What the command line asks for.
pub struct StartRequest<'a> {
    /// Capture document.
    pub capture: &'a Path,
    /// Model to start from at step 0.
    pub init_ply: Option<&'a Path>,
    /// Checkpoint to continue.
    pub resume: Option<&'a Path>,
    /// Options of the command line; a checkpoint brings its own.
    pub options: FitOptions,
    /// Seed of the command line; a checkpoint brings its own.
    pub seed: u64,
    /// Wall seconds instead of steps.
    pub time_budget: Option<f64>,
}

/// Everything loaded and checked.
pub struct Start {
    /// Photos to fit to.
    pub train: Vec<TrainingImage>,
    /// Photos to measure on.
    pub held_out: Vec<TrainingImage>,
    /// Options in effect.
    pub options: FitOptions,
    /// Seed in effect.
    pub seed: u64,
    /// SHA-256 of the capture document.
    pub capture_sha256: String,
    points: SparsePoints,
    model: Option<Gaussians>,
    state: Option<FitState>,
    time_budget: Option<f64>,
}

impl StartRequest<'_> {
    /// Reads everything.
    ///
    /// # Errors
    /// When a file is missing or bad, or the checkpoint belongs to another capture.
    pub fn load(self, context: &Context) -> anyhow::Result<Start> {
        context.input("capture", self.capture)?;
        let capture = read_capture(self.capture)?;
        let load = |split| load_training_images(self.capture, &capture, &capture.views_of(split));
        let (train, held_out) = (load(Split::Train)?, load(Split::Test)?);
        let capture_sha256 = sha256_of(self.capture)?;
        let (mut options, mut seed, mut state, mut model) = (self.options, self.seed, None, None);
        if let Some(path) = self.resume {
            context.input("resume", path)?;
            let checkpoint = read_checkpoint(path)?;
            if checkpoint.capture_sha256 != capture_sha256 {
                let text = format!("the checkpoint belongs to another capture: {}", path.display());
                let remedy = "use --init-ply to start from its model";
                return Err(StageError::bad_input(text).help(remedy).into());
            }
            (options, seed) = (checkpoint.options, checkpoint.seed);
            state = Some(checkpoint.state);
        }
        if let Some(path) = self.init_ply {
            context.input("init-ply", path)?;
            model = Some(read_gaussians(path)?);
        }
        if let Some(seconds) = self.time_budget {
            options = options.for_time_budget(seconds);
        }
        let (points, time_budget) = (capture.points, self.time_budget);
        Ok(Start {
            train,
            held_out,
            options,
            seed,
            capture_sha256,
            points,
            model,
            state,
            time_budget,
        })
    }
}

impl Start {
    /// The fit, ready for its first step.
    ///
    /// # Errors
    /// When an option cannot be used, there is no training photo, or the checkpoint does not fit.
    pub fn trainer(&self) -> anyhow::Result<Trainer> {
        let (options, seed) = (&self.options, self.seed);
        let trainer = match self.state.clone() {
            Some(state) => Trainer::resume(&self.train, &self.points, state, options, seed),
            None => Trainer::new(&self.train, &self.points, self.model.clone(), options, seed),
        };
        let mut trainer = trainer.map_err(to_stage)?;
        if let Some(seconds) = self.time_budget {
            trainer.set_time_budget(seconds);
        }
        Ok(trainer)
    }
}

/// The exit code that each kind of error stands for.
fn to_stage(error: FitError) -> StageError {
    let text = error.to_string();
    match error {
        FitError::Option { .. } => StageError::usage(text),
        FitError::NoViews => StageError::bad_input(text)
            .help("import with --test-every or --test-list so that some views stay for training"),
        FitError::Checkpoint(_) => StageError::bad_input(text),
    }
}
