//! Arguments of `edit` and what happens to them.

use std::path::PathBuf;

use super::{EditAnswer, EditJob, OpFlags, ReshadeFlags, run_edit};
use crate::plan::EditPlanDocument;
use clap::{ArgAction, Parser};
use motes_formats::documents::{schema, to_pretty_json};
use motes_protocol::ProviderFlags;
use motes_stage::{CommonArgs, Context, HasCommon};
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  Remove the selected object and fill the ground behind it:
    edit --scene scene/ --capture c.json --selection selection.json --delete -o without/
  Another material for the selected object, with pictures before and after:
    edit --scene scene/ --selection selection.json --set-material brass --thumbnails views/ -o new/
  Move the selection of a plain splat:
    edit --gaussians gaussians.ply --selection selection.json --translate 0.2,0,0 -o moved.ply
  All operations of a plan:
    edit --scene scene/ --plan plan.json -o edited/";

/// Edit a splat or a decomposed scene with a plan or flags
#[derive(Parser, Debug, Serialize)]
#[command(name = "edit", after_help = EXAMPLES)]
pub struct Args {
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

    /// Edit plan; operations given as flags follow it
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,

    /// Folder that the plan may read from, beside its own and the scene's; repeatable
    #[arg(long, value_name = "DIR")]
    assets: Vec<PathBuf>,

    /// Capture with cameras and photos, for views, refits and --stylize
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,

    /// Scene folder, or splat to write; its suffix determines the format
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,

    /// Folder for images: before.png, after.png and the previews of the plan
    #[arg(long, value_name = "DIR")]
    thumbnails: Option<PathBuf>,

    /// View of the capture whose photo gets the edit, as photo-VIEW.png beside the thumbnails; repeatable
    #[arg(long, value_name = "VIEW", requires_all = ["capture", "thumbnails"])]
    photo: Vec<String>,

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
        "plan",
        "output",
        "delete",
        "translate",
        "set-material",
        "insert",
        "thumbnails",
    ];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a gate that is not met, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<EditAnswer> {
    let job = EditJob {
        scene: args.scene.as_deref(),
        gaussians: args.gaussians.as_deref(),
        capture: args.capture.as_deref(),
        plan: args.plan.as_deref(),
        assets: &args.assets,
        flags: &args.ops,
        reshade: &args.reshade,
        seed: args.seed,
        provider: &args.provider,
        thumbnails: args.thumbnails.as_deref(),
        photos: &args.photo,
        output: &args.output,
    };
    run_edit(&job, context)
}

/// JSON Schema of the plan that the stage reads.
pub fn plan_schema() -> String {
    to_pretty_json(&schema::<EditPlanDocument>().1)
}
