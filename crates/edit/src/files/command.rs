//! Edit a splat or a decomposed scene by a plan: select, move, delete, insert, recolor, relight, clean up.
//!
//! Inputs: a scene folder (`motes/decomposition` 1.x) or Gaussians (PLY); a plan (`motes/edit-plan` 1.x), or its operations as
//! flags. Output: the same kind, with the plan as executed.
//!
//! ```text
//! edit --scene scene/ --plan plan.json -o edited/
//! edit --gaussians in.ply --remove-floaters --rotate-euler 90,0,0 -o out.ply
//! edit --scene scene/ --selection selection.json --delete --fill plane -o edited/
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/edit.md`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{ArgAction, Parser};
use motes_formats::documents::{schema, to_pretty_json};
use motes_formats::edit_plan::EditPlanDocument;
use motes_stage::{CommonArgs, Context, HasCommon};
use motes_stages::edit::{EditAnswer, EditJob, OpFlags, ReshadeFlags, run_edit};
use serde::Serialize;

/// Edit a splat or a decomposed scene by a plan or by flags
#[derive(Parser, Debug, Serialize)]
#[command(name = "edit")]
struct Args {
    /// Scene folder, as decompose makes it
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

    /// Plan of operations; operations of flags follow it
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,

    /// Capture with cameras and photos, for views and for --stylize
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,

    /// Scene folder or splat (.ply) to write
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,

    /// Folder for pictures: before.png, after.png and those that the plan asks for
    #[arg(long, value_name = "DIR")]
    thumbnails: Option<PathBuf>,

    /// Seed of the random numbers [default: the plan's]
    #[arg(long, value_name = "SEED")]
    seed: Option<u64>,

    /// Print the JSON Schema of plans and exit
    #[arg(long, action = ArgAction::SetTrue)]
    #[serde(skip)]
    print_schema: bool,

    #[command(flatten)]
    #[serde(flatten)]
    reshade: ReshadeFlags,

    #[command(flatten)]
    #[serde(flatten)]
    ops: OpFlags,

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
    motes_stage::main_with_schema(run, || to_pretty_json(&schema::<EditPlanDocument>().1))
}

fn run(args: &Args, context: &Context) -> anyhow::Result<EditAnswer> {
    let job = EditJob {
        scene: args.scene.as_deref(),
        gaussians: args.gaussians.as_deref(),
        capture: args.capture.as_deref(),
        plan: args.plan.as_deref(),
        flags: &args.ops,
        reshade: &args.reshade,
        seed: args.seed,
        thumbnails: args.thumbnails.as_deref(),
        output: &args.output,
    };
    run_edit(&job, context)
}
