//! Arguments of `decompose` and what happens to them.

use std::path::PathBuf;

use clap::Parser;
use motes_stage::{CommonArgs, Context, HasCommon};
use serde::Serialize;

use super::known::KnownArgs;
use super::preset::{PRESETS, Preset};
use super::report::DecomposeReport;
use super::request::Request;
use super::work::StepArgs;
use crate::options::DecomposeOptions;

const EXAMPLES: &str = "\
Examples:
  Surface, material and light of a trained scene, then the scene relit by a low sun:
    decompose --capture OUT/capture.json --gaussians gaussians.ply -o scene/
    relight --scene scene/ --sun azimuth=90,elevation=8 --sky --capture OUT/capture.json --split test -o morning/
  The light is known (a mirror ball, a light stage, another renderer):
    decompose --capture OUT/capture.json --gaussians gaussians.ply --environment light.exr --env-convention blender -o scene/
  Two captures under different light, which separates base color from light:
    decompose --capture day/capture.json --capture evening/capture.json --gaussians gaussians.ply -o scene/
  Stop after the light, inspect or replace it, then continue with the materials:
    decompose --capture OUT/capture.json --gaussians gaussians.ply --work work/ --until light
    decompose --capture OUT/capture.json --gaussians gaussians.ply --work work/ --from materials -o scene/

Exit codes: 0 done, 1 failed, 2 usage or output exists, 3 bad input data, 4 written, but the decomposition has failed,
130 interrupted";

/// Decompose a scene into surface, material and light
#[derive(Parser, Debug, Serialize)]
#[command(name = "decompose", after_help = EXAMPLES)]
pub struct Args {
    /// Capture that the Gaussians were fitted to; repeat it for captures of the same scene under
    /// other light
    #[arg(long, value_name = "FILE", required = true)]
    capture: Vec<PathBuf>,

    /// Gaussians of the scene (PLY)
    #[arg(long, value_name = "FILE")]
    gaussians: PathBuf,

    /// Scene folder to write
    #[arg(short, long, value_name = "DIR", required_unless_present = "until")]
    output: Option<PathBuf>,

    /// Surface to use instead of extracting one (PLY mesh with normals, in the capture's world)
    #[arg(long, value_name = "FILE", help_heading = "Known quantities")]
    surface: Option<PathBuf>,

    /// Speed against quality; flags that are given win
    #[arg(long, value_enum, default_value_t)]
    preset: Preset,

    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,

    /// Number of views whose components are written as previews
    #[arg(long, default_value_t = 4, value_name = "COUNT")]
    previews: usize,

    #[command(flatten)]
    #[serde(flatten)]
    known: KnownArgs,

    #[command(flatten)]
    #[serde(flatten)]
    steps: StepArgs,

    #[command(flatten)]
    #[serde(flatten)]
    options: DecomposeOptions,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "capture",
        "gaussians",
        "output",
        "preset",
        "seed",
        "surface",
        "environment",
        "lobes",
        "specular",
    ];

    const PRESETS: &'static [motes_stage::Preset] = PRESETS;

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a gate that is not met, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<DecomposeReport> {
    let request = Request {
        captures: &args.capture,
        gaussians: &args.gaussians,
        surface: args.surface.as_deref(),
        known: &args.known,
        options: &args.options,
        steps: &args.steps,
        seed: args.seed,
        previews: args.previews,
        output: args.output.as_deref(),
    };
    request.run(context)
}
