//! Arguments of `evaluate` and what happens to them.

use std::path::PathBuf;

use super::read_training;
use crate::evaluation::{
    Contestant, Course, EvaluationOptions, EvaluationOutputs, EvaluationReport, Results, protocol,
    protocol_words,
};
use crate::lpips::Lpips;
use crate::page::{EvaluationPage, PictureChoice};
use crate::score::GateMetric;
use crate::training_curves::Training;
use clap::Parser;
use motes_formats::atomic::write_atomic;
use motes_formats::capture::read_capture;
use motes_formats::documents::write_document;
use motes_formats::images::write_png;
use motes_scene::View;
use motes_stage::{CommonArgs, Context, HasCommon, OrBadInput as _, StageError};
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  Scores of the held-out views, as text and as a page with error maps:
    evaluate --capture capture.json --gaussians gaussians.ply
    evaluate --capture capture.json --gaussians gaussians.ply --metrics m.json --report scores.html
  Images of another program, with the same protocol:
    evaluate --capture capture.json --renders other-program/test
  A gate for continuous integration (exit code 4 when it is not met):
    evaluate --capture capture.json --gaussians gaussians.ply --require 'psnr>=25'";

/// A photo, its render, and the planes of the scores.
const VIEW_BYTES_PER_PIXEL: u64 = 120;

/// Score Gaussians, or the renders of any program, against the photos of a capture
#[derive(Parser, Debug, Serialize)]
#[command(name = "evaluate", after_help = EXAMPLES)]
pub struct Args {
    /// Capture with the photos
    #[arg(long, value_name = "FILE")]
    capture: PathBuf,

    /// Gaussians to render and score (PLY); repeatable, for example for several seeds
    #[arg(long, value_name = "FILE", required_unless_present = "renders")]
    gaussians: Vec<PathBuf>,

    /// Folder of images rendered by any program, named after the views; repeatable
    #[arg(long, value_name = "DIR", conflicts_with = "gaussians")]
    renders: Vec<PathBuf>,

    /// Folder of images to score beside the Gaussians; repeatable
    #[arg(long, value_name = "DIR")]
    also_renders: Vec<PathBuf>,

    #[command(flatten)]
    #[serde(flatten)]
    options: EvaluationOptions,

    #[command(flatten)]
    #[serde(flatten)]
    outputs: EvaluationOutputs,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "capture",
        "gaussians",
        "renders",
        "split",
        "require",
        "metrics",
        "report",
        "save-renders",
        "background",
    ];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a gate that is not met, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<EvaluationReport> {
    let options = &args.options;
    let outputs = &args.outputs;
    for output in outputs.paths() {
        match outputs.metrics.as_ref() == Some(output) {
            true => context.json_output(output)?,
            false => context.output(output)?,
        };
    }
    if options.requires(GateMetric::Lpips) && options.lpips_weights.is_none() {
        return Err(StageError::usage("--require lpips needs --lpips-weights").into());
    }
    context.input("capture", &args.capture)?;
    let capture = read_capture(&args.capture)?;
    let splits = options.splits();
    let camera = |view: &View| &capture.cameras[view.camera];
    let sizes = capture.views.iter().map(camera).map(|c| (c.width, c.height));
    context.need_memory_for_pictures(sizes, VIEW_BYTES_PER_PIXEL)?;
    let course = Course::new(&args.capture, &capture, &splits).or_bad_input()?;
    let contestants = load_contestants(args, context)?;
    for (role, path) in [("lpips-weights", &options.lpips_weights), ("training", &outputs.training)]
    {
        path.as_ref().map_or(Ok(()), |path| context.input(role, path))?;
    }
    let (net, range) = (options.lpips_net, options.lpips_range);
    let load = |path: &PathBuf| Lpips::load(path, net, range);
    let lpips = options.lpips_weights.as_ref().map(load).transpose()?;
    let training = match outputs.training.as_deref() {
        Some(path) => {
            let parsed = read_training(path)?;
            parsed.warnings.iter().for_each(|text| context.warn(text));
            parsed.document
        }
        None => Training::default(),
    };
    context.stop_if_dry_run()?;

    let progress = context.progress("scoring", (course.len() * contestants.len()) as u64);
    let mut pictures = PictureChoice::new(course.count_of(options.split), outputs.report_views);
    let mut results = Results { split: options.split, models: Vec::new() };
    for (i, contestant) in contestants.iter().enumerate() {
        let scores = course.run(contestant, options, lpips.as_ref(), |view| {
            context.check_interrupted()?;
            if let (Some(folder), 0) = (&outputs.save_renders, i) {
                write_png(&folder.join(format!("{}.png", view.stem)), view.render)?;
            }
            if outputs.report.is_some() && i == 0 && options.split.includes(view.split) {
                pictures.offer(view.name, view.photo, view.render);
            }
            progress.inc(1);
            anyhow::Ok(())
        })?;
        results.models.push(scores);
    }
    drop(progress);

    let protocol = protocol(options, lpips.as_ref(), course.common_size());
    if let Some(path) = &outputs.report {
        let protocol = protocol_words(&protocol);
        let models = results.models.clone();
        let page = EvaluationPage { models, splits, pictures, training, protocol };
        write_atomic(path, |writer| writer.write_all(page.to_html().as_bytes()))?;
    }
    let document = results.to_document(protocol);
    if let Some(path) = &outputs.metrics {
        write_document(path, &document)?;
    }
    for gate in results.check(&options.require).iter().filter(|gate| !gate.met) {
        context.gate_not_met(gate.sentence());
    }
    Ok(EvaluationReport(document))
}

fn load_contestants(args: &Args, context: &Context) -> anyhow::Result<Vec<Contestant>> {
    let mut contestants = Vec::new();
    for path in &args.gaussians {
        context.input("gaussians", path)?;
        contestants.push(Contestant::load_model(path, args.options.antialias)?);
    }
    for folder in args.renders.iter().chain(&args.also_renders) {
        context.input("renders", folder)?;
        contestants.push(Contestant::Folder(folder.clone()));
    }
    Ok(contestants)
}
