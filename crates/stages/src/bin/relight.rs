//! Relight a decomposed scene: pictures, a baked splat or a scene folder under another light.
//!
//! Inputs: a scene folder (`motes/decomposition` 1.x), a light (EXR, HDR, sun and sky), poses from a
//! capture (`motes/capture` 1.x) or a camera path. Output: a folder of PNG or EXR files, a PLY, or a
//! scene folder.
//!
//! ```text
//! relight --scene scene/ --environment light.exr --capture OUT/capture.json --split test -o relit/
//! relight --scene scene/ --sun azimuth=120,elevation=8 --sky -o baked.ply
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/relight.md`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use motes_relighting::{Background, BakeOptions, LightOptions, QualityOptions};
use motes_report::frames::{
    BetweenOptions, FrameSelection, FrameSize, PictureFormat, VideoOptions, shell_words,
};
use motes_stage::{CommonArgs, Context, HasCommon};
use motes_stages::relight::{
    LoadedScene, NewLight, PictureJob, PoseSource, Product, RelightReport, load_frames,
    write_baked, write_pictures, write_scene,
};
use serde::Serialize;

/// Relight a decomposed scene: pictures, a baked splat or a scene folder under another light
#[derive(Parser, Debug, Serialize)]
#[command(name = "relight", mut_group("FrameSelection", |group| group.required(false)))]
struct Args {
    /// Scene folder, as decompose makes it
    #[arg(long, value_name = "DIR")]
    scene: PathBuf,

    /// Capture that gives cameras and poses
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,

    /// Folder for the pictures; a file NAME.ply for a splat with baked colours
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,

    /// What to make [default: a splat when the output ends in .ply, pictures otherwise]
    #[arg(long = "as", value_enum, value_name = "PRODUCT")]
    product: Option<ProductChoice>,

    #[command(flatten)]
    #[serde(flatten)]
    light: LightOptions,

    #[command(flatten)]
    #[serde(flatten)]
    quality: QualityOptions,

    #[command(flatten)]
    #[serde(flatten)]
    selection: FrameSelection,

    #[command(flatten)]
    #[serde(flatten)]
    between: BetweenOptions,

    #[command(flatten)]
    #[serde(flatten)]
    size: FrameSize,

    /// Behind the scene: transparent, environment, captured, black, white or r,g,b from 0 to 1
    #[arg(long, value_name = "BACKGROUND", default_value = "environment")]
    background: Background,

    /// 8-bit sRGB PNG, multi-channel linear EXR with all components, or both
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t = PictureFormat::Png)]
    format: PictureFormat,

    /// Turn the light once round over N numbered pictures
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    turntable: Option<u32>,

    #[command(flatten)]
    #[serde(flatten)]
    bake: BakeOptions,

    /// Seed of the random numbers
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    seed: u64,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
enum ProductChoice {
    /// A folder of pictures
    Pictures,
    /// Gaussians with baked colours
    Splat,
    /// A scene folder with the new light
    Scene,
}

impl HasCommon for Args {
    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

fn main() -> ExitCode {
    motes_stage::main(run)
}

fn run(args: &Args, context: &Context) -> anyhow::Result<RelightReport> {
    let output = context.output(&args.output)?;
    let product = match args.product {
        Some(ProductChoice::Pictures) => Product::Pictures,
        Some(ProductChoice::Splat) => Product::Splat,
        Some(ProductChoice::Scene) => Product::Scene,
        None if output.extension().is_some_and(|e| e == "ply") => Product::Splat,
        None => Product::Pictures,
    };
    let poses = PoseSource {
        capture: args.capture.as_ref(),
        selection: &args.selection,
        between: &args.between,
        size: &args.size,
        numbered: false,
        turntable: args.turntable,
    };
    let frames = match product {
        Product::Pictures => load_frames(&poses, context)?,
        Product::Splat | Product::Scene => Vec::new(),
    };
    let loaded = LoadedScene::load(&args.scene, context)?;
    let light = NewLight::load(&args.light, &loaded, context)?;
    let report = light.report(&light.turned(0.0)?, context);
    context.stop_if_dry_run()?;
    let mut report =
        RelightReport::new(product, output.clone(), report, &args.quality, &loaded.scene);
    let job = PictureJob {
        loaded: &loaded,
        light: &light,
        frames: &frames,
        quality: &args.quality,
        background: args.background,
        format: args.format,
        seed: args.seed,
    };
    match product {
        Product::Pictures => {
            write_pictures(&job, &output, &mut report, context)?;
            if args.turntable.is_some() || args.selection.path.is_some() {
                let video = VideoOptions { video_frames: true, video: None, fps: 30 };
                report.video_command = Some(shell_words(&video.command(&output)));
            }
        }
        Product::Splat => write_baked(&job, &args.bake, &output, &mut report, context)?,
        Product::Scene => write_scene(&loaded, &light, &output)?,
    }
    Ok(report)
}
