//! Arguments of `instruct` and what happens to them.

use std::path::PathBuf;

use clap::Parser;
use motes_formats::documents::write_document;
use motes_protocol::ProviderFlags;
use motes_stage::{CommonArgs, Context, HasCommon, StageError};
use serde::Serialize;

use super::inputs::Inputs;
use super::products::Products;
use super::provider::ask;
use super::report::Report;
use crate::language::{Misread, interpret};

const EXAMPLES: &str = "\
Examples:
  A plan for edit:
    instruct 'make it a sunset and move the ball right' --scene s/ --labels l.json -o p.json
  The edited scene at once:
    instruct 'make the lemon twice as large' --scene scene/ --labels labels.json --apply -o edited/
  Alternatives, a scene per light:
    instruct 'matte black cabinets at noon and sunset' --scene s/ --labels l.json --apply -o out/
  What is in a scene:
    instruct --scene scene/ --capture c.json --labels labels.json --card scene-card.json";

/// Turn an instruction into an edit plan
#[derive(Parser, Debug, Serialize)]
#[command(name = "instruct", after_help = EXAMPLES)]
pub struct Args {
    /// What to change, in English
    #[arg(value_name = "INSTRUCTION", required_unless_present = "card")]
    instruction: Option<String>,

    /// Scene folder written by decompose, relight or edit
    #[arg(
        long,
        value_name = "DIR",
        required_unless_present = "gaussians",
        conflicts_with = "gaussians"
    )]
    scene: Option<PathBuf>,

    /// Gaussians (PLY)
    #[arg(long, value_name = "FILE")]
    gaussians: Option<PathBuf>,

    /// Capture whose view says what left, right, front and up mean
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,

    /// View of the capture that directions refer to [default: the first]
    #[arg(long, value_name = "NAME", requires = "capture")]
    view: Option<String>,

    /// Labels: names of objects and their selections
    #[arg(long, value_name = "FILE")]
    labels: Option<PathBuf>,

    /// Folder of the files that an instruction may insert
    #[arg(long, value_name = "DIR")]
    assets: Option<PathBuf>,

    /// Length of a world unit, meters, for amounts such as "20 cm"
    #[arg(long, value_name = "METERS", value_parser = positive)]
    meters_per_unit: Option<f64>,

    /// Edit plan to write (JSON); with --apply the scene folder or splat
    #[arg(short, long, value_name = "PATH", required_if_eq("apply", "true"))]
    output: Option<PathBuf>,

    /// Run the plan, as edit does
    #[arg(long, requires = "instruction")]
    apply: bool,

    /// Print each operation as a sentence
    #[arg(long)]
    explain: bool,

    /// File for the scene card (JSON)
    #[arg(long, value_name = "FILE")]
    card: Option<PathBuf>,

    /// Folder for pictures before and after, with --apply
    #[arg(long, value_name = "DIR", requires = "apply")]
    thumbnails: Option<PathBuf>,

    /// Seed of the random numbers
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    seed: u64,

    #[command(flatten)]
    #[serde(flatten)]
    provider: ProviderFlags,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "scene",
        "gaussians",
        "capture",
        "labels",
        "assets",
        "meters-per-unit",
        "output",
        "apply",
        "explain",
        "provider",
    ];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
    value.ok_or_else(|| "expected meters above 0".into())
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, an instruction that is not understood, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
    let card_file = args.card.as_ref().map(|path| context.json_output(path)).transpose()?;
    if let Some(path) = args.output.as_ref().filter(|_| !args.apply) {
        // Before the work; alternatives are claimed by their own names.
        context.json_output(path)?;
    }
    let command = args.provider.command(context)?;
    let inputs = Inputs::load(
        &super::inputs::Paths {
            scene: args.scene.as_deref(),
            gaussians: args.gaussians.as_deref(),
            capture: args.capture.as_deref(),
            view: args.view.as_deref(),
            labels: args.labels.as_deref(),
            assets: args.assets.as_deref(),
            meters_per_unit: args.meters_per_unit,
        },
        context,
    )?;
    let card = inputs.card()?;
    let mut report = Report { explained: args.explain, ..Report::default() };
    if let Some(instruction) = &args.instruction {
        let (found, provider) = match command {
            Some(command) => {
                ask(&inputs, &card, instruction, command, &args.provider, args.seed, context)?
            }
            None => (interpret(&card, instruction).map_err(misread)?, None),
        };
        report.instruction.clone_from(instruction);
        report.notes.clone_from(&found.notes);
        report.provider = provider;
        let products = Products {
            output: args.output.as_deref(),
            is_applied: args.apply,
            thumbnails: args.thumbnails.as_deref(),
            seed: args.seed,
        };
        products.make(&inputs, &card, found.plans, &mut report, context)?;
    } else {
        context.stop_if_dry_run()?;
    }
    if let Some(path) = card_file {
        write_document(&path, &card)?;
        report.card = Some(path);
    }
    Ok(report)
}

fn misread(error: Misread) -> StageError {
    StageError::bad_input(error.cause).help(error.help)
}
