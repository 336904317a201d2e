//! The command line of `motes-provider-diffusion`.

use std::path::PathBuf;

use clap::Parser;
use motes_protocol::{Answered, Asked};
use motes_stage::{CommonArgs, Context, HasCommon};
use serde::Serialize;

use crate::Diffusion;
use crate::answer::told;
use crate::options::Options;

const EXAMPLES: &str = "\
Examples:
  What it is, and with which weights:
    motes-provider-diffusion --describe --model stable-diffusion-v1-5/ --weights ic-light/
  A quick preview under another light:
    relight ... --provider 'diffusion --model stable-diffusion-v1-5/ --weights ic-light/ --size 256 --second-scale 1' --prompt 'sunset'
  Pictures edited as a text says:
    edit ... --stylize 'make it autumn' --provider 'diffusion --model instruct-pix2pix/'";

/// Relit pictures by IC-Light, edited pictures by InstructPix2Pix, on your safetensors files
#[derive(Parser, Debug, Serialize)]
#[command(
    name = "provider-diffusion",
    after_help = EXAMPLES
)]
pub struct Args {
    /// Folder of Stable Diffusion 1.5 (with --weights), or of InstructPix2Pix, in the layout of diffusers
    #[arg(long, value_name = "DIR")]
    model: PathBuf,

    /// IC-Light: iclight_sd15_fc.safetensors (by prompt), iclight_sd15_fbc.safetensors (by background), or their folder
    #[arg(long, value_name = "PATH")]
    weights: Option<PathBuf>,

    #[command(flatten)]
    #[serde(flatten)]
    asked: Asked,

    /// License of the weights, for run records [default: that of the published weights]
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    license: Option<String>,

    #[command(flatten)]
    #[serde(flatten)]
    options: Options,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Describes itself or answers.
///
/// # Errors
/// The weights or the request are bad.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Answered> {
    let mut diffusion =
        Diffusion::open(&args.model, args.weights.as_deref(), &args.options).map_err(told)?;
    if args.asked.describe {
        let description = diffusion.description(args.license.as_deref()).map_err(told)?;
        return Answered::described(&description, context);
    }
    let watch = |evaluations: u64| -> Box<dyn Fn()> {
        let progress = context.progress("denoising", evaluations);
        Box::new(move || progress.inc(1))
    };
    args.asked.answer(context, &mut |request, folder| diffusion.answer(request, folder, &watch))
}
