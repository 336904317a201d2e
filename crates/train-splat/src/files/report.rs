//! What `train-splat` says when it is done.

use std::fmt;

use std::collections::BTreeMap;

use crate::Plan;
use motes_formats::documents::Document as _;
use motes_formats::train_report::{TrainReportDocument, TrainingPoint};
use motes_stage::Context;
use serde::Serialize;

use super::model_report::ModelReport;
use super::profile::ProfileReport;
use super::pseudo::PseudoReport;
use super::scores::{Held, TargetOutcome};
use super::session::Session;
use super::verdict::Verdict;

/// The report of a run, also written by `--metrics`: a [`TrainReportDocument`].
#[derive(Clone, Debug, Serialize)]
pub struct TrainReport {
    /// Always `motes/train-report`.
    pub format: &'static str,
    /// Layout version.
    pub version: String,
    /// Whether all steps were done.
    pub complete: bool,
    /// Steps done.
    pub iterations: u32,
    /// Gaussians written.
    pub gaussians: usize,
    /// Training photos.
    pub train_views: usize,
    /// Held-out photos.
    pub test_views: usize,
    /// Training photos scored: all, unless time was short.
    pub train_views_scored: usize,
    /// Held-out photos scored.
    pub test_views_scored: usize,
    /// Mean PSNR of the training photos, dB (8-bit renders, mean of views).
    pub psnr_train: Option<f64>,
    /// The same for the held-out photos.
    pub psnr_test: Option<f64>,
    /// `psnr_train - psnr_test`
    pub psnr_gap: Option<f64>,
    /// Wall seconds of the whole stage.
    pub seconds: f64,
    /// CPU seconds of the whole stage.
    pub cpu_seconds: Option<f64>,
    /// Peak resident memory, bytes.
    pub peak_memory_bytes: Option<u64>,
    /// Whether per-photo exposures were fitted.
    pub exposure: bool,
    /// Spread of the photos' log gains; 0 where it was not measured.
    pub exposure_gain_spread: f64,
    /// Whether the fit is usable, and what it is judged by.
    pub verdict: Verdict,
    /// Which components are in, and the evidence.
    pub model: ModelReport,
    /// Length that learning rates refer to, world units.
    pub extent: f64,
    /// The numbers of the run.
    pub plan: Plan,
    /// Wall seconds per phase.
    pub phases: BTreeMap<&'static str, f64>,
    /// Where the time went, in detail, when asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<ProfileReport>,
    /// What became of `--target`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<TargetOutcome>,
    /// What became of `--pseudo-views`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pseudo_views: Option<PseudoReport>,
    /// The training curve.
    pub history: Vec<TrainingPoint>,
}

impl TrainReport {
    /// The report of a finished session; `scores` are those of the training and held-out photos.
    pub fn new(
        session: &Session<'_>,
        scores: [Option<Held>; 2],
        verdict: Verdict,
        context: &Context,
    ) -> Self {
        let trainer = &session.trainer;
        let [train_scored, test_scored] = scores.map(|held| held.map_or(0, |h| h.views));
        let [train, test] = scores.map(|held| held.map(|h| h.psnr));
        Self {
            format: TrainReportDocument::FORMAT,
            version: TrainReportDocument::version(),
            complete: trainer.is_done(),
            iterations: trainer.state.step,
            gaussians: trainer.state.gaussians.len(),
            train_views: trainer.state.exposures.values.len(),
            test_views: session.held_out.len(),
            train_views_scored: train_scored,
            test_views_scored: test_scored,
            psnr_train: train,
            psnr_test: test,
            psnr_gap: train.zip(test).map(|(train, test)| train - test),
            seconds: context.elapsed_seconds(),
            cpu_seconds: context.cpu_seconds(),
            peak_memory_bytes: context.peak_memory_bytes(),
            exposure: trainer.fits_exposure(),
            exposure_gain_spread: trainer.state.gain_spread,
            verdict,
            model: ModelReport::new(trainer, context.cpu_seconds()),
            extent: trainer.extent(),
            plan: trainer.plan().clone(),
            phases: trainer.profile.phases().iter().map(|t| (t.phase.name(), t.wall_s)).collect(),
            profile: None,
            pseudo_views: None,
            target: session.outcome,
            history: session.history.clone(),
        }
    }
}

impl TrainReport {
    /// Adds where the time went, `--profile`.
    #[must_use]
    pub fn with_profile(mut self, session: &Session<'_>, context: &Context) -> Self {
        let cpu_s = self.cpu_seconds.unwrap_or(0.0);
        let profile = &session.trainer.profile;
        self.profile = Some(ProfileReport::new(profile, context.threads(), self.seconds, cpu_s));
        self
    }
}

impl fmt::Display for TrainReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let db = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.2} dB"));
        writeln!(
            f,
            "{} Gaussians after {} steps on {} photos in {:.1} s ({} CPU)",
            self.gaussians,
            self.iterations,
            self.train_views,
            self.seconds,
            self.cpu_seconds.map_or("unknown".to_owned(), |s| format!("{s:.1} s")),
        )?;
        writeln!(
            f,
            "PSNR train {}  test {} ({} held-out photos)  gap {}",
            db(self.psnr_train),
            db(self.psnr_test),
            self.test_views_scored,
            db(self.psnr_gap),
        )?;
        if let Some(target) = &self.target {
            let aside = if target.set_aside { " set aside from training" } else { "" };
            let on = format!("{} held-out photos{aside}", target.views);
            match target.reached {
                true => writeln!(
                    f,
                    "target {} dB reached at step {} on {on}",
                    target.psnr, target.best_step
                )?,
                false => writeln!(
                    f,
                    "target {} dB NOT reached: best {} at step {} on {on}",
                    target.psnr,
                    db(target.best_psnr),
                    target.best_step
                )?,
            }
        }
        write!(f, "{}", self.model)?;
        match &self.profile {
            Some(profile) => write!(f, "\n{profile}"),
            None => Ok(()),
        }
    }
}

/// What a dry run says: the numbers of the run that would follow.
#[derive(Clone, Debug, Serialize)]
pub(super) struct DryRun {
    /// What preset, flags and number of photos come to.
    #[serde(flatten)]
    pub(super) plan: Plan,
    /// Whether `--time-budget` decides the numbers in the end.
    #[serde(skip)]
    pub(super) timed: bool,
}

impl fmt::Display for DryRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plan = &self.plan;
        if self.timed {
            return write!(f, "--time-budget decides steps, Gaussians and resolutions");
        }
        write!(f, "{} steps", plan.iterations)?;
        if plan.longest > 1.0 {
            let most = f64::from(plan.iterations) * plan.longest;
            write!(f, " (to {most:.0} where photos see little of the scene each)")?;
        }
        write!(
            f,
            ", at most {} Gaussians, SH degree {}, refined every {} steps, resolutions {}",
            plan.max_gaussians,
            plan.sh_degree,
            plan.refine_every,
            plan.schedule()
        )
    }
}
