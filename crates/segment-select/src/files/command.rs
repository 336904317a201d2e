//! Arguments of `segment-select` and what happens to them.

use std::path::PathBuf;

use super::{
    ExtraProducts, Inputs, PromptFlags, SegmenterFlags, SegmenterReport, SelectReport, answer,
    write_products,
};
use crate::MaskProvider;
use clap::Parser;
use motes_stage::{CommonArgs, Context, HasCommon, OrBadInput as _};
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  The object under a click in view a, drawn over the views:
    segment-select --gaussians g.ply --capture c.json --click a,210,140 --overlay views/ -o s.json
  The same without what a second click points at:
    segment-select --gaussians g.ply --capture c.json --click a,210,140 --click a,90,60,- -o s.json
  Gaussians in a sphere, less the ground:
    segment-select --gaussians g.ply --select sphere=0,0,1,0.5 --select subtract:ground -o s.json";

/// Select Gaussians by clicks, boxes, masks, shapes, colors and properties
#[derive(Parser, Debug, Serialize)]
#[command(name = "segment-select", after_help = EXAMPLES)]
pub struct Args {
    /// Gaussians to select from (PLY)
    #[arg(long, value_name = "FILE", required_unless_present = "scene")]
    gaussians: Option<PathBuf>,

    /// Scene folder to select from, instead of --gaussians
    #[arg(long, value_name = "DIR", conflicts_with = "gaussians")]
    scene: Option<PathBuf>,

    /// Capture with the views, for prompts in pixels
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,

    /// Selection to write (JSON)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    #[command(flatten)]
    #[serde(flatten)]
    prompt: PromptFlags,

    #[command(flatten)]
    #[serde(flatten)]
    extra: ExtraProducts,

    #[command(flatten)]
    #[serde(flatten)]
    segmenter: SegmenterFlags,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "gaussians",
        "scene",
        "capture",
        "output",
        "click",
        "box",
        "select",
        "candidates",
        "overlay",
        "mask",
    ];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a gate that is not met, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<SelectReport> {
    let steps = args.prompt.steps()?;
    let outputs = args.extra.claim(&args.output, args.prompt.candidates, context)?;
    let inputs = Inputs::load(
        args.gaussians.as_deref(),
        args.scene.as_deref(),
        args.capture.as_deref(),
        context,
    )?;
    let segmenter = args.segmenter.command(context)?;
    context.stop_if_dry_run()?;
    let segmenter = args.segmenter.open(segmenter, context)?;
    let mut source = inputs.source();
    if let Some(segmenter) = &segmenter {
        source = source.with_segmenter(segmenter as &dyn MaskProvider);
    }
    // Without a capture there are no views to keep.
    if let Some(cache) = args.capture.as_ref().and_then(|_| args.extra.cache_folder()) {
        source = source.with_cache(&cache);
    }
    let start = context.elapsed_seconds();
    if args.prompt.needs_views() && args.capture.is_some() {
        source.index().or_bad_input()?;
    }
    let prepared = context.elapsed_seconds();
    let answer = answer(&source, &args.prompt, &steps);
    if segmenter.is_some() {
        // What it was stopped at is no fault of the input.
        context.check_interrupted()?;
    }
    let answer = answer?;
    let mut report = SelectReport::new(&source, &answer, &args.output);
    if let Some(doubt) = report.doubt() {
        context.warn(doubt);
    }
    report.segmenter = segmenter.as_ref().map(|s| SegmenterReport::new(s, inputs.capture.as_ref()));
    report.seconds_prepare = prepared - start;
    report.seconds_answer = context.elapsed_seconds() - prepared;
    write_products(&inputs, &source, &answer, &args.extra, &outputs, context)?;
    Ok(report)
}
