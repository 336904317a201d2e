//! Arguments of `export` and what happens to them.

use std::path::PathBuf;

use super::batch::{claim, export_all, is_folder};
use super::{
    Asset, AssetJob, AssetOptions, BatchReport, CameraOptions, CameraReport, ExportFormat,
    ExportReport, InputOptions, Outcome, SplatOptions, VerifyOptions, verify, write_asset,
    write_splat,
};
use clap::Parser;
use motes_codecs::SplatFormat;
use motes_stage::{CommonArgs, Context, HasCommon, StageError};
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  A small file for web viewers, verified by rendering it again:
    export gaussians.ply -o gaussians.spz --verify --min-psnr 40
  Many files, each as a file of the same name in a folder:
    export captures/*.ply --format spz -o small/
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

    /// File or folder to write; the suffix determines the format. With --format and a folder that
    /// exists or ends in a slash, each input becomes a file in it
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
    let given = args.asset.html.then_some(ExportFormat::Asset(Asset::Html)).or(args.format);
    if let (Some(ExportFormat::Splat(splat)), true) = (given, is_folder(&args.output)) {
        return export_batch(args, splat, context).map(|report| Outcome::Batch(report.into()));
    }
    let output = context.output(&args.output)?;
    let format = ExportFormat::choose(given, &output)?;
    match format {
        ExportFormat::Splat(splat) => {
            args.verify.check(splat, &output)?;
            let report = export_splat(args, &args.input, splat, output, context)?;
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

/// Every input as a file of its own.
fn export_batch(args: &Args, splat: SplatFormat, context: &Context) -> anyhow::Result<BatchReport> {
    let inputs: Vec<PathBuf> =
        args.input.inputs.iter().chain(&args.input.gaussians).cloned().collect();
    if inputs.is_empty() {
        let text = format!("a folder of files needs files: {}", args.output.display());
        return Err(StageError::usage(text).help("name them, or write to a file").into());
    }
    let outputs = claim(&inputs, &args.output, splat, context)?;
    outputs.iter().try_for_each(|output| args.verify.check(splat, output))?;
    context.stop_if_dry_run()?;
    export_all(&inputs, outputs, &args.output, context, |input, output| {
        let own =
            InputOptions { inputs: vec![input.to_owned()], gaussians: None, ..args.input.clone() };
        export_splat(args, &own, splat, output, context)
    })
}

fn export_splat(
    args: &Args,
    input: &InputOptions,
    splat: SplatFormat,
    output: PathBuf,
    context: &Context,
) -> anyhow::Result<ExportReport> {
    let source = input.load(context)?;
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
        format: ExportFormat::Splat(splat),
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
