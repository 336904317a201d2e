//! Inverse rendering: photos and their Gaussians to surface, material and light.
//!
//! Inputs: captures (`motes/capture` 1.x) of one scene, Gaussians (PLY). Output: a scene folder
//! (`motes/decomposition` 1.0): Gaussians with material columns, `surface.ply`, `environment.exr`,
//! `decomposition.json`, previews.
//!
//! ```text
//! decompose --capture OUT/capture.json --gaussians gaussians.ply -o scene/
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/decompose.md`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use motes_inverse::DecomposeOptions;
use motes_inverse::geometry::GeometryOptions;
use motes_stage::{CommonArgs, Context, HasCommon};
use motes_stages::decomposing::{DecomposeReport, KnownArgs, Request};
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  Surface, material and light of a trained scene, then the scene in the morning:
    decompose --capture OUT/capture.json --gaussians gaussians.ply -o scene/
    relight --scene scene/ --sun azimuth=90,elevation=8 --sky --capture OUT/capture.json --split test -o morning/
  The light is known (a mirror ball, a light stage, another renderer):
    decompose --capture OUT/capture.json --gaussians gaussians.ply --environment light.exr --env-convention blender -o scene/
  Two captures of one scene under different light tell base colour and light apart:
    decompose --capture day/capture.json --capture evening/capture.json --gaussians gaussians.ply -o scene/

Exit codes: 0 done, 1 failed, 2 usage or output exists, 3 bad input data, 130 interrupted";

/// Take a scene apart into surface, material and light
#[derive(Parser, Debug, Serialize)]
#[command(name = "decompose", after_help = EXAMPLES)]
struct Args {
    /// Capture that the Gaussians were fitted to; again for captures of the same scene under other light
    #[arg(long, value_name = "FILE", required = true)]
    capture: Vec<PathBuf>,

    /// Gaussians of the scene (PLY)
    #[arg(long, value_name = "FILE")]
    gaussians: PathBuf,

    /// Scene folder to write
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Surface to use instead of extracting one (PLY mesh in the capture's world, with normals)
    #[arg(long, value_name = "FILE", help_heading = "Known")]
    surface: Option<PathBuf>,

    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,

    /// Views whose components are written as previews
    #[arg(long, default_value_t = 4, value_name = "COUNT")]
    previews: usize,

    #[command(flatten)]
    #[serde(flatten)]
    known: KnownArgs,

    #[command(flatten)]
    #[serde(flatten)]
    geometry: GeometryOptions,

    #[command(flatten)]
    #[serde(flatten)]
    options: DecomposeOptions,

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

fn run(args: &Args, context: &Context) -> anyhow::Result<DecomposeReport> {
    let output = context.output(&args.output)?;
    let request = Request {
        captures: &args.capture,
        gaussians: &args.gaussians,
        surface: args.surface.as_deref(),
        known: &args.known,
        geometry: &args.geometry,
        options: &args.options,
        seed: args.seed,
        previews: args.previews,
    };
    request.run(&output, context)
}
