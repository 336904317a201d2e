//! The command line of `motes-provider-sam`.

use std::fmt;
use std::io::{Write as _, stdin};
use std::path::PathBuf;

use clap::{ArgGroup, Parser};
use motes_formats::documents::to_pretty_json;
use motes_protocol::serve::{answer, serve};
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
    after_help = EXAMPLES,
    group = ArgGroup::new("what").required(true).args(["describe", "request", "serve"])
)]
pub struct Args {
    /// Folder with the encoder and the decoder, or one of both beside the other (ONNX)
    #[arg(long, value_name = "PATH")]
    model: PathBuf,

    /// The decoder, where its name does not tell (ONNX)
    #[arg(long, value_name = "FILE")]
    decoder: Option<PathBuf>,

    /// Print what this provider is and stop
    #[arg(long)]
    describe: bool,

    /// Answer a request and stop
    #[arg(long, value_name = "FILE")]
    request: Option<PathBuf>,

    /// Answer requests, a line each, until the input ends
    #[arg(long)]
    serve: bool,

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

/// Nothing: what it says is in the reply.
#[derive(Debug, Serialize)]
pub struct Report {}

impl fmt::Display for Report {
    fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
        Ok(())
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
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
    let weights = Weights::find(&args.model, args.decoder.as_deref()).map_err(told)?;
    let load = || Sam::load(&weights, context.threads(), args.cache().as_ref()).map_err(told);
    if args.describe {
        // Weights that do not load describe nothing.
        load()?;
        let text = to_pretty_json(&description(&weights, &args.license).map_err(told)?);
        context.stdout().write_all(text.as_bytes())?;
        return Ok(Report {});
    }
    let mut sam = load()?;
    match &args.request {
        Some(request) => {
            answer(request, &mut |request, folder| sam.answer(request, folder))?;
        }
        None => {
            let work = &mut |request: &_, folder: &_| sam.answer(request, folder);
            serve(stdin().lock(), context.stdout(), work)?;
        }
    }
    Ok(Report {})
}
