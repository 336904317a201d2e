//! Running a fit: progress, evaluation, checkpoints, interruption.

use std::path::{Path, PathBuf};

use crate::{Failure, FitOptions, Lap, Phase, Trainer, TrainingImage};
use motes_formats::event_file::EventFile;
use motes_formats::train_report::TrainingPoint;
use motes_raster::RenderOptions;
use motes_stage::{Context, StageError};
use serde_json::json;

use super::checkpoint::{Checkpoint, write_checkpoint};
use super::failure_words::{contradiction, what_is_wrong};
use super::scores::{Held, Target, TargetOutcome};
use super::snapshots::{self, Snapshots};
use super::start::Start;

/// Rows of the training curve at least this many steps apart.
const HISTORY_EVERY: u32 = 50;
/// Held-out photos that are looked at on the way to a target.
const TARGET_VIEWS: usize = 8;
/// Share of a run that looking at them may take.
const TARGET_SHARE: f64 = 0.05;
/// Cost of a step over that of a rendering of as many pixels: forward, loss, twice as much
/// backward, and what is done per Gaussian.
const STEP_OVER_RENDER: f64 = 3.0;

/// A fit and what surrounds it.
pub struct Session<'a> {
    /// The fit.
    pub trainer: Trainer,
    /// Held-out photos.
    pub held_out: &'a [TrainingImage],
    /// Whether they are training photos set aside for the target.
    pub set_aside: bool,
    /// Options of the fit, for the checkpoint.
    pub options: FitOptions,
    /// Seed of the fit, for the checkpoint.
    pub seed: u64,
    /// SHA-256 of the capture, for the checkpoint.
    pub capture_sha256: String,
    /// Where checkpoints go.
    pub checkpoint: PathBuf,
    /// Steps between evaluations.
    pub eval_every: Option<u32>,
    /// Steps between checkpoints.
    pub save_every: Option<u32>,
    /// PLY files of the model on the way.
    pub(super) snapshots: Option<Snapshots>,
    /// Curves for TensorBoard.
    pub(super) events: Option<EventFile>,
    /// Stop once the held-out photos reach this.
    pub target: Option<Target>,
    /// What became of it.
    pub outcome: Option<TargetOutcome>,
    /// The curve so far.
    pub history: Vec<TrainingPoint>,
    /// What the fit was made from, for another beginning.
    pub(super) start: &'a Start,
}

impl Start {
    /// The session around the fit.
    ///
    /// # Errors
    /// As [`Self::trainer`].
    pub fn session(&self, checkpoint: PathBuf) -> anyhow::Result<Session<'_>> {
        Ok(Session {
            trainer: self.trainer()?,
            held_out: &self.held_out,
            set_aside: self.set_aside,
            options: self.options.clone(),
            seed: self.seed,
            capture_sha256: self.capture_sha256.clone(),
            checkpoint,
            eval_every: None,
            save_every: None,
            snapshots: None,
            events: None,
            target: None,
            outcome: None,
            history: Vec::new(),
            start: self,
        })
    }
}

/// Why a session ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionEnd {
    /// All steps were done, or the target was reached.
    Done,
    /// The user interrupted; the checkpoint is saved.
    Interrupted,
}

impl Session<'_> {
    /// Runs until the fit is done or the user stops it.
    ///
    /// # Errors
    /// When a checkpoint cannot be written.
    pub fn run(&mut self, context: &Context) -> anyhow::Result<SessionEnd> {
        if let Some(poses) = &self.trainer.state.model.start.poses
            && poses.is_contradiction()
        {
            context.warn(contradiction(poses));
        }
        let by_time = self.trainer.is_timed();
        let total = if by_time { 1000 } else { u64::from(self.trainer.plan().iterations) };
        let progress = context.progress("training", total);
        progress.resume_from(u64::from(self.trainer.state.step).min(total));
        let began = context.elapsed_seconds();
        let (mut loss_sum, mut loss_count) = (0.0, 0u32);
        let mut pixels = 0;
        while !self.trainer.is_done() {
            if context.interrupted() {
                self.save()?;
                return Ok(SessionEnd::Interrupted);
            }
            let report = self.trainer.step();
            loss_sum += report.loss.loss;
            loss_count += 1;
            pixels += report.pixels;
            let step = self.trainer.state.step;
            let done =
                if by_time { (self.trainer.progress() * 1000.0) as u64 } else { u64::from(step) };
            progress.set(done);

            let due =
                |every: Option<u32>| every.is_some_and(|every| step.is_multiple_of(every.max(1)));
            if due(self.save_every) {
                self.save()?;
            }
            self.snapshot(context)?;
            let by_work = self.eval_every.is_none()
                && self.target.is_some()
                && TARGET_SHARE * STEP_OVER_RENDER * pixels as f64 >= self.look_pixels() as f64;
            let (held, reached) = match by_work || due(self.eval_every) {
                true => {
                    pixels = 0;
                    self.evaluate(by_work)
                }
                false => (None, false),
            };
            if step.is_multiple_of(HISTORY_EVERY) || held.is_some() || self.trainer.is_done() {
                let row = TrainingPoint {
                    step,
                    gaussians: self.trainer.state.gaussians.len() as u64,
                    loss: loss_sum / f64::from(loss_count.max(1)),
                    psnr_test: held.map(|h| h.psnr),
                    seconds: context.elapsed_seconds() - began,
                };
                (loss_sum, loss_count) = (0.0, 0);
                let test = row.psnr_test.map(|p| format!(", test {p:.2} dB")).unwrap_or_default();
                progress
                    .message(format!("loss {:.4}, {} Gaussians{test}", row.loss, row.gaussians));
                progress.event("step", &json!(row));
                if let Some(events) = &mut self.events {
                    snapshots::log_point(events, &row)?;
                }
                self.history.push(row);
            }
            if reached {
                break;
            }
            if let Some(failure) = self.trainer.failure_on_the_way() {
                self.begin_again(&failure, context)?;
                progress.set(u64::from(self.trainer.state.step));
            }
        }
        self.trainer.finish();
        Ok(SessionEnd::Done)
    }

    /// Begins again from the next start, where there is one.
    fn begin_again(&mut self, failure: &Failure, context: &Context) -> anyhow::Result<()> {
        let Some(next) = self.trainer.next_start() else { return Ok(()) };
        let now = &self.trainer.state.model.start;
        context.warn(format!(
            "after {} steps from the start \"{}\" {}; beginning again from \"{}\"",
            self.trainer.state.step,
            now.from.name(),
            what_is_wrong(failure),
            next.name()
        ));
        let mut failed = now.failed.clone();
        failed.push(now.from);
        self.trainer = self.start.another_trainer(&failed)?;
        self.history.clear();
        if let Some(snapshots) = &self.snapshots {
            snapshots.forget();
        }
        Ok(())
    }

    /// Writes the model so far where one is due, as it would be written now; the fit goes on from what it was.
    fn snapshot(&mut self, context: &Context) -> anyhow::Result<()> {
        let step = self.trainer.state.step;
        let Some(snapshots) = self.snapshots.as_mut().filter(|s| s.is_due(step)) else {
            return Ok(());
        };
        let lap = Lap::start();
        let model = self.start.world.gaussians_in_world(self.trainer.model());
        snapshots.write(step, &model, context)?;
        self.trainer.profile.add(Phase::Write, lap);
        Ok(())
    }

    /// The scores of the finished model as the last points of the curves for TensorBoard.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn log_scores(&mut self, [train, test]: [Option<Held>; 2]) -> anyhow::Result<()> {
        let step = self.trainer.state.step;
        let Some(events) = &mut self.events else { return Ok(()) };
        snapshots::log_scores(events, step, train.map(|h| h.psnr), test.map(|h| h.psnr))
    }

    /// Scores of the training and of the held-out photos: all, or as many as a time budget leaves
    /// room for.
    pub fn final_scores(&mut self, start: &Start) -> [Option<Held>; 2] {
        let lap = Lap::start();
        let most = usize::MAX;
        // As the written model shows them.
        let model = start.world.gaussians_in_world(self.trainer.model());
        let (background, parameters) =
            (self.trainer.background(), self.trainer.raster_parameters());
        let options = RenderOptions { background, parameters, ..RenderOptions::default() };
        let [train_poses, test_poses] = &start.world_poses;
        let score =
            |images, poses| Held::score_model(&model, &options, images, poses, most, start.end);
        let test = score(self.held_out, test_poses);
        let train = score(&start.train, train_poses);
        self.note(test.filter(|held| held.views == self.held_out.len()));
        self.trainer.profile.add(Phase::Score, lap);
        [train, test]
    }

    /// Pixels of one look at the held-out photos.
    fn look_pixels(&self) -> u64 {
        let looked = self.held_out.len().min(TARGET_VIEWS) as u64;
        let all: u64 = self.held_out.iter().map(|image| image.image.pixel_count() as u64).sum();
        all * looked / self.held_out.len().max(1) as u64
    }

    /// Scores the held-out photos, a few of them when `some`, and whether the target is reached:
    /// what a few say, all have to confirm.
    fn evaluate(&mut self, some: bool) -> (Option<Held>, bool) {
        let lap = Lap::start();
        let most = if some { TARGET_VIEWS } else { usize::MAX };
        let mut held = Held::score_until(&self.trainer, self.held_out, most, None);
        let mut reached = self.reaches(held);
        if reached && held.is_some_and(|h| h.views < self.held_out.len()) {
            held = Held::score(&self.trainer, self.held_out);
            reached = self.reaches(held);
        }
        self.trainer.profile.add(Phase::Evaluate, lap);
        self.note(held);
        (held, reached)
    }

    fn reaches(&self, held: Option<Held>) -> bool {
        self.target.zip(held).is_some_and(|(target, held)| held.psnr >= target.psnr)
    }

    /// Keeps the best score for the report of a target.
    pub fn note(&mut self, held: Option<Held>) {
        let Some(target) = self.target else { return };
        let step = self.trainer.state.step;
        let reached = self.reaches(held);
        let views = self.held_out.len();
        let outcome = self.outcome.get_or_insert(TargetOutcome {
            psnr: target.psnr,
            reached: false,
            best_psnr: None,
            best_step: 0,
            views,
            set_aside: self.set_aside,
        });
        outcome.reached |= reached;
        if let Some(held) = held
            && outcome.best_psnr.is_none_or(|best| held.psnr > best)
        {
            (outcome.best_psnr, outcome.best_step) = (Some(held.psnr), step);
        }
    }

    /// The error that an interrupted run ends with.
    pub fn interrupted(&self) -> StageError {
        let (step, path) = (self.trainer.state.step, self.checkpoint.display());
        let text = format!("interrupted at step {step}; checkpoint saved: {path}");
        StageError::interrupted(text).help("continue with --resume")
    }

    /// Saves a checkpoint.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&mut self) -> anyhow::Result<()> {
        let lap = Lap::start();
        let checkpoint = Checkpoint {
            state: self.trainer.state.clone(),
            options: self.options.clone(),
            seed: self.seed,
            capture_sha256: self.capture_sha256.clone(),
        };
        write_checkpoint(&self.checkpoint, &checkpoint)?;
        self.trainer.profile.add(Phase::Write, lap);
        Ok(())
    }
}

/// Where checkpoints of a product go: `gaussians.ply` → `gaussians.checkpoint.safetensors`.
pub fn default_checkpoint(output: &Path) -> PathBuf {
    output.with_extension("checkpoint.safetensors")
}
