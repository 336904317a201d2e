//! Arguments of `export` and what happens to them.

use std::path::PathBuf;

use super::{
    Asset, AssetJob, AssetOptions, CameraOptions, CameraReport, ExportFormat, ExportReport,
    InputOptions, Outcome, SplatOptions, VerifyOptions, verify, write_asset, write_splat,
};
use clap::Parser;
use motes_codecs::SplatFormat;
use motes_stage::{CommonArgs, Context, HasCommon};
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  A small file for web viewers, verified by rendering it again:
    export gaussians.ply -o gaussians.spz --verify --min-psnr 40
  One HTML page that shows the splat and compares it with photos:
    export gaussians.ply --capture capture/capture.json -o viewer.html
  A relightable mesh for Blender, with its environment map:
    export --scene scene/ --format mesh --target blender -o mesh.glb
  Cameras for COLMAP:
    export --capture capture/capture.json --format colmap -o model/";

/// Export Gaussians, meshes and cameras to the formats of other programs
#[derive(Parser, Debug, Serialize)]
#[command(name = "export", after_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    #[serde(flatten)]
    input: InputOptions,

    /// File or folder to write; the suffix determines the format
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,

    /// Format to write, whatever the suffix
    #[arg(long, value_enum, value_name = "FORMAT")]
    format: Option<ExportFormat>,

    #[command(flatten)]
    #[serde(flatten)]
    splat: SplatOptions,

    #[command(flatten)]
    #[serde(flatten)]
    verify: VerifyOptions,

    #[command(flatten)]
    #[serde(flatten)]
    cameras: CameraOptions,

    #[command(flatten)]
    #[serde(flatten)]
    asset: AssetOptions,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "gaussians",
        "scene",
        "output",
        "format",
        "capture",
        "verify",
        "title",
        "min-psnr",
        "seed",
    ];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a gate that is not met, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let output = context.output(&args.output)?;
    let given = args.asset.html.then_some(ExportFormat::Asset(Asset::Html)).or(args.format);
    let format = ExportFormat::choose(given, &output)?;
    match format {
        ExportFormat::Splat(splat) => {
            let report = export_splat(args, format, splat, output, context)?;
            Ok(Outcome::Splat(report.into()))
        }
        ExportFormat::Asset(asset) => {
            let (input, options, seed) = (&args.input, &args.asset, args.splat.seed);
            let capture = args.cameras.capture.as_deref();
            let job = AssetJob { asset, input, capture, options, seed };
            write_asset(&job, &output, context).map(|report| Outcome::Asset(report.into()))
        }
        ExportFormat::Cameras(kind) => {
            let cameras = args.cameras.load(context)?;
            context.stop_if_dry_run()?;
            cameras.write(kind, &output, context)?;
            Ok(Outcome::Cameras(CameraReport { format, output, poses: cameras.len() }))
        }
    }
}

fn export_splat(
    args: &Args,
    format: ExportFormat,
    splat: SplatFormat,
    output: PathBuf,
    context: &Context,
) -> anyhow::Result<ExportReport> {
    let source = args.input.load(context)?;
    args.verify.check(splat, &output)?;
    context.stop_if_dry_run()?;
    let start = context.cpu_seconds();
    write_splat(&source, splat, &args.splat, &output, context)?;
    let cpu_seconds_write = start.zip(context.cpu_seconds()).map(|(a, b)| b - a);
    let capture = args.cameras.capture.as_deref();
    let verify = match args.verify.verify {
        true => Some(verify(&source.file, &output, &args.verify, capture, context)?),
        false => None,
    };
    let gaussians = source.file.gaussians.len();
    let bytes = std::fs::metadata(&output).ok().map(|found| found.len());
    Ok(ExportReport {
        format,
        output,
        gaussians,
        sh_degree: source.file.gaussians.sh_degree,
        dropped_invalid: source.dropped_invalid,
        dropped_faint: source.dropped_faint,
        bytes,
        bytes_per_gaussian: bytes.map(|bytes| bytes as f64 / gaussians as f64),
        cpu_seconds_write,
        verify,
    })
}
