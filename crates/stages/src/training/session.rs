//! Running a fit: progress, evaluation, checkpoints, interruption.

use std::path::{Path, PathBuf};

use motes_fit::{FitOptions, Trainer, TrainingImage};
use motes_stage::Context;
use serde_json::json;

use super::checkpoint::{Checkpoint, write_checkpoint};
use super::report::HistoryRow;
use super::scores::{Held, Target};

/// Rows of the training curve at least this many steps apart.
const HISTORY_EVERY: u32 = 50;

/// A fit and what surrounds it.
pub struct Session<'a> {
    /// The fit.
    pub trainer: Trainer,
    /// Held-out photos.
    pub held_out: &'a [TrainingImage],
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
    /// Stop once the held-out photos reach this.
    pub target: Option<Target>,
    /// The curve so far.
    pub history: Vec<HistoryRow>,
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
        let by_time = self.trainer.is_timed();
        let total = if by_time { 1000 } else { u64::from(self.trainer.plan().iterations) };
        let progress = context.progress("training", total);
        progress.resume_from(u64::from(self.trainer.state.step).min(total));
        let began = context.elapsed_seconds();
        let (mut loss_sum, mut loss_count) = (0.0, 0u32);
        while !self.trainer.is_done() {
            if context.interrupted() {
                self.save()?;
                return Ok(SessionEnd::Interrupted);
            }
            let report = self.trainer.step();
            loss_sum += report.loss.loss;
            loss_count += 1;
            let step = self.trainer.state.step;
            let done =
                if by_time { (self.trainer.progress() * 1000.0) as u64 } else { u64::from(step) };
            progress.set(done);

            let due =
                |every: Option<u32>| every.is_some_and(|every| step.is_multiple_of(every.max(1)));
            if due(self.save_every) {
                self.save()?;
            }
            let held =
                due(self.eval_every).then(|| Held::score(&self.trainer, self.held_out)).flatten();
            if step.is_multiple_of(HISTORY_EVERY) || held.is_some() || self.trainer.is_done() {
                let row = HistoryRow {
                    step,
                    gaussians: self.trainer.state.gaussians.len(),
                    loss: loss_sum / f64::from(loss_count.max(1)),
                    psnr_test: held.map(|h| h.psnr),
                    seconds: context.elapsed_seconds() - began,
                };
                (loss_sum, loss_count) = (0.0, 0);
                let test = row.psnr_test.map(|p| format!(", test {p:.2} dB")).unwrap_or_default();
                progress
                    .message(format!("loss {:.4}, {} Gaussians{test}", row.loss, row.gaussians));
                progress.event("step", &json!(row));
                self.history.push(row);
            }
            if let (Some(target), Some(held)) = (self.target, held)
                && held.psnr >= target.psnr
            {
                break;
            }
        }
        Ok(SessionEnd::Done)
    }

    /// Saves a checkpoint.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self) -> anyhow::Result<()> {
        let checkpoint = Checkpoint {
            state: self.trainer.state.clone(),
            options: self.options.clone(),
            seed: self.seed,
            capture_sha256: self.capture_sha256.clone(),
        };
        Ok(write_checkpoint(&self.checkpoint, &checkpoint)?)
    }
}

/// Where checkpoints of a product go: `gaussians.ply` → `gaussians.checkpoint.safetensors`.
pub fn default_checkpoint(output: &Path) -> PathBuf {
    output.with_extension("checkpoint.safetensors")
}
