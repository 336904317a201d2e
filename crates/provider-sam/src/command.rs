//! The command line of `motes-provider-sam`.

use std::path::PathBuf;

use clap::Parser;
use motes_protocol::{Answered, Asked};
use motes_stage::{CommonArgs, Context, HasCommon};
use serde::Serialize;

use crate::answer::{description, told};
use crate::{Sam, Weights};

const EXAMPLES: &str = "\
Examples:
  What it is, and with which weights:
    motes-provider-sam --describe --model sam/
  As segment-select starts it:
    motes-provider-sam --serve --model sam/vit_b.encoder.onnx --decoder sam/vit_b.decoder.onnx";

/// Masks from prompts by SAM, SAM 2.1 or MobileSAM in ONNX files
#[derive(Parser, Debug, Serialize)]
#[command(
    name = "provider-sam",
    after_help = EXAMPLES
)]
pub struct Args {
    /// Folder with the encoder and the decoder, or one of both beside the other (ONNX)
    #[arg(long, value_name = "PATH")]
    model: PathBuf,

    /// The decoder, where its name does not tell (ONNX)
    #[arg(long, value_name = "FILE")]
    decoder: Option<PathBuf>,

    #[command(flatten)]
    #[serde(flatten)]
    asked: Asked,

    /// License of the weights, for run records
    #[arg(long, value_name = "NAME", default_value = "unknown")]
    license: String,

    /// Folder for embeddings, so that a picture is encoded once; none keeps no embeddings [default: motes/sam in the user's folder of caches]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

impl Args {
    fn cache(&self) -> Option<PathBuf> {
        match &self.cache {
            Some(folder) if folder.as_os_str() == "none" => None,
            Some(folder) => Some(folder.clone()),
            None => motes_protocol::user_cache("sam"),
        }
    }
}

/// Describes itself or answers.
///
/// # Errors
/// The weights or the request are bad.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Answered> {
    let weights = Weights::find(&args.model, args.decoder.as_deref()).map_err(told)?;
    // Weights that do not load describe nothing.
    let mut sam = Sam::load(&weights, context.threads(), args.cache().as_ref()).map_err(told)?;
    if args.asked.describe {
        let description = description(&weights, &args.license).map_err(told)?;
        return Answered::described(&description, context);
    }
    args.asked.answer(context, &mut |request, folder| sam.answer(request, folder))
}
