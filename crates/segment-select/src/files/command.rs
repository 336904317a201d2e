//! Select Gaussians by clicks, boxes, masks, shapes, colours and properties.
//!
//! Inputs: Gaussians (PLY) or a scene folder (`motes/decomposition` 1.x); for prompts in pixels a
//! capture (`motes/capture` 1.x). Output: `selection.json` (`motes/selection` 1.0); on request overlay
//! pictures, a PLY with a column of labels, a PLY with Gaussians split at the selection's edge.
//!
//! ```text
//! segment-select --capture OUT/capture.json --gaussians gaussians.ply --click VIEW,X,Y -o selection.json
//! segment-select --gaussians gaussians.ply --select sphere=0,0,0,0.5 --select subtract:property=opacity,lt,0.1 -o selection.json
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input or nothing selected, 130
//! interrupted. Manual: `docs/stages/segment-select.md`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use motes_stage::{CommonArgs, Context, HasCommon, OrBadInput as _};
use motes_stages::selecting::{
    ExtraProducts, Inputs, PromptFlags, SelectReport, answer, write_products,
};
use serde::Serialize;

/// Select Gaussians by clicks, boxes, masks, shapes, colours and properties
#[derive(Parser, Debug, Serialize)]
#[command(name = "segment-select")]
struct Args {
    /// Gaussians to select from (PLY)
    #[arg(long, value_name = "FILE", required_unless_present = "scene")]
    gaussians: Option<PathBuf>,

    /// Scene folder to select from, in place of --gaussians
    #[arg(long, value_name = "DIR", conflicts_with = "gaussians")]
    scene: Option<PathBuf>,

    /// Capture that gives views, for prompts in pixels
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,

    /// Selection to write
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
    common: CommonArgs,
}

impl HasCommon for Args {
    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

fn main() -> ExitCode {
    motes_stage::main(run)
}

fn run(args: &Args, context: &Context) -> anyhow::Result<SelectReport> {
    let steps = args.prompt.steps()?;
    let outputs = args.extra.claim(&args.output, args.prompt.candidates, context)?;
    let inputs = Inputs::load(
        args.gaussians.as_deref(),
        args.scene.as_deref(),
        args.capture.as_deref(),
        context,
    )?;
    context.stop_if_dry_run()?;
    let mut source = inputs.source();
    // Without a capture there are no views to keep.
    if let Some(cache) = args.capture.as_ref().and_then(|_| args.extra.cache_folder()) {
        source = source.with_cache(&cache);
    }
    let start = context.elapsed_seconds();
    if args.prompt.needs_views() && args.capture.is_some() {
        source.index().or_bad_input()?;
    }
    let prepared = context.elapsed_seconds();
    let answer = answer(&source, &args.prompt, &steps)?;
    let mut report = SelectReport::new(&source, &answer, &args.output);
    report.seconds_prepare = prepared - start;
    report.seconds_answer = context.elapsed_seconds() - prepared;
    write_products(&inputs, &source, &answer, &args.extra, &outputs, context)?;
    Ok(report)
}
