//! Arguments of `train-splat` and what happens to them.

use std::path::{Path, PathBuf};

use super::page::{Page, snapshot_every};
use super::pseudo::add_pseudo_views;
use super::report::DryRun;
use super::snapshots::Snapshots;
use super::{
    PseudoOptions, Session, SessionEnd, StartRequest, Target, TrainReport, Verdict,
    default_checkpoint, parse_seconds,
};
use crate::{FitOptions, Lap, Phase};
use motes_formats::documents::to_pretty_json;
use motes_formats::event_file::EventFile;
use motes_formats::ply::{PlyWriteOptions, write_gaussians};
use motes_stage::{CommonArgs, Context, Habit, HasCommon, StageError};
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  A first look in seconds, then the default quality:
    train-splat --capture capture/capture.json -o draft.ply --preset draft
    train-splat --capture capture/capture.json -o gaussians.ply
  Continue after Ctrl-C (bit for bit as if it had not been stopped):
    train-splat --capture capture/capture.json -o gaussians.ply --resume gaussians.checkpoint.safetensors
  Refit the colors of an existing splat:
    train-splat --capture capture/capture.json -o refit.ply --init-ply gaussians.ply --freeze geometry

Then: evaluate --capture capture/capture.json --gaussians gaussians.ply
Exit codes: 0 done, 1 failed, 2 usage or output exists, 3 bad input data, 4 the fit
has failed, 130 interrupted with a checkpoint saved";

/// Fit 3D Gaussians to the photos of a capture
#[derive(clap::Parser, Serialize)]
#[command(name = "train-splat", after_help = EXAMPLES)]
pub struct Args {
    /// Capture to fit (capture.json)
    #[arg(long, value_name = "FILE")]
    capture: PathBuf,

    /// Gaussians to write (PLY)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,

    /// Start from these Gaussians instead of the capture's points
    #[arg(long, value_name = "FILE", conflicts_with = "resume", help_heading = "Initialization")]
    init_ply: Option<PathBuf>,

    /// Continue from a checkpoint, with its options and seed
    #[arg(long, alias = "ckpt", value_name = "FILE", help_heading = "Initialization")]
    resume: Option<PathBuf>,

    /// Checkpoint to write [default: the output with the suffix .checkpoint.safetensors]
    #[arg(long, value_name = "FILE", help_heading = "Schedule")]
    checkpoint: Option<PathBuf>,

    /// Steps between checkpoints; one is always saved on Ctrl-C
    #[arg(long, value_name = "STEPS", help_heading = "Schedule")]
    save_every: Option<u32>,

    /// Steps between evaluations on the held-out photos
    #[arg(long, value_name = "STEPS", help_heading = "Schedule")]
    eval_every: Option<u32>,

    /// Duration of the run, scoring and writing included; the settings are the best measured ones
    /// for this time. The result then depends on the machine
    #[arg(long, value_name = "SECONDS", conflicts_with_all = ["iterations", "resume"], help_heading = "Schedule", value_parser = parse_seconds)]
    time_budget: Option<f64>,

    /// Stop when the held-out photos reach this, for example psnr=25; without test photos, every
    /// eighth training photo is held out for it
    #[arg(long, value_name = "psnr=DB", help_heading = "Schedule")]
    target: Option<Target>,

    /// Write the report (loss curve, scores, times, settings) as JSON
    #[arg(long, value_name = "FILE.json")]
    metrics: Option<PathBuf>,

    /// Steps between snapshots: the model so far as PLY, NAME.step-000500.ply beside the product
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Outputs")]
    export_every: Option<u32>,

    /// Show the fit in your browser as it goes: starts the program `view`, which stays after the fit. Without --export-every
    /// twenty snapshots are written for it, of which none is kept
    #[arg(long, help_heading = "Outputs")]
    view: bool,

    /// With --view: open no browser, only tell the address
    #[arg(long, requires = "view", help_heading = "Outputs")]
    no_browser: bool,

    /// Write curves for TensorBoard into this folder: loss, PSNR and count of Gaussians against steps
    #[arg(long, value_name = "DIR", help_heading = "Outputs")]
    tensorboard: Option<PathBuf>,

    /// Report wall and CPU time per phase and per unit of work
    #[arg(long)]
    profile: bool,

    #[command(flatten)]
    #[serde(flatten)]
    options: FitOptions,

    #[command(flatten)]
    #[serde(flatten)]
    pseudo: PseudoOptions,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "capture",
        "output",
        "preset",
        "seed",
        "metrics",
        "init-ply",
        "resume",
        "time-budget",
        "target",
        "iterations",
    ];
    const HABITS: &'static [Habit] = &[("random-bkgd", "background=random")];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a gate that is not met, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<TrainReport> {
    let output = context.output(&args.output)?;
    if let Some(metrics) = &args.metrics {
        context.json_output(metrics)?;
    }
    let provider = args.pseudo.command(args.init_ply.is_some(), context)?;
    let request = StartRequest {
        capture: &args.capture,
        init_ply: args.init_ply.as_deref(),
        resume: args.resume.as_deref(),
        options: args.options.clone(),
        seed: args.seed,
        time_budget: args.time_budget,
        needs_held_out: args.target.is_some(),
    };
    let mut start = request.load(context)?;
    if context.dry_run() {
        context
            .stop_if_dry_run_with(&DryRun { plan: start.plan()?, timed: start.end.is_some() })?;
    }

    let pseudo = match provider {
        Some(provider) => Some(add_pseudo_views(&mut start, provider, &args.pseudo, context)?),
        None => None,
    };
    let checkpoint = args.checkpoint.clone().unwrap_or_else(|| default_checkpoint(&args.output));
    let mut session = start.session(checkpoint)?;
    (session.eval_every, session.save_every) = (args.eval_every, args.save_every);
    session.target = args.target;
    let ply = PlyWriteOptions {
        exposure_response: start.exposure_response,
        ..PlyWriteOptions::default()
    };
    session.snapshots = args.snapshots(&session, &output, &ply)?;
    let open = || Page::open(&output, &args.capture, args.no_browser);
    let page = args.view.then(open).transpose()?;
    session.events = args.tensorboard.as_deref().map(EventFile::create).transpose()?;
    if args.profile {
        session.trainer.count_pairs();
    }
    if session.run(context)? == SessionEnd::Interrupted {
        return Err(session.interrupted().into());
    }
    let lap = Lap::start();
    let model = start.world.gaussians_in_world(session.trainer.model());
    let broken = model.invalid_rows().len();
    if broken > 0 {
        let text =
            format!("the fit diverged: {broken} of {} Gaussians are not finite", model.len());
        let help = "lower the learning rates, and look at the cameras of the capture";
        anyhow::bail!("{text}\nhelp: {help}");
    }
    write_gaussians(&output, &model, &ply)?;
    session.trainer.profile.add(Phase::Write, lap);
    let scores = session.final_scores(&start);
    session.log_scores(scores)?;
    let verdict = Verdict::new(&mut session, &start, scores[1], context);
    let mut report = TrainReport::new(&session, scores, verdict, context);
    report.extent *= start.world.length;
    report.train_views = start.train.len();
    report.pseudo_views = pseudo;
    if args.profile {
        report = report.with_profile(&session, context);
    }
    if let Some(path) = &args.metrics {
        let text = to_pretty_json(&report);
        motes_formats::atomic::write_atomic(path, |out| out.write_all(text.as_bytes()))?;
    }
    if let Some(page) = page {
        page.leave_open(context);
    }
    Ok(report)
}

impl Args {
    /// The snapshots that are asked for, or that a page needs.
    fn snapshots(
        &self,
        session: &Session<'_>,
        output: &Path,
        ply: &PlyWriteOptions,
    ) -> Result<Option<Snapshots>, StageError> {
        let iterations = session.trainer.plan().iterations;
        let for_page = || self.view.then(|| snapshot_every(iterations));
        let Some(every) = self.export_every.or_else(for_page) else { return Ok(None) };
        let (from, overwrite) = (session.trainer.state.step, self.common.overwrite);
        let snapshots = Snapshots::new(every, output, ply.clone(), from, overwrite)?;
        Ok(Some(if self.export_every.is_some() { snapshots } else { snapshots.for_a_look() }))
    }
}
