//! Arguments of `relight` and what happens to them.

use std::path::PathBuf;

use super::{
    LiftJob, LoadedScene, NewLight, Outcome, PictureJob, PoseOptions, Product, ProviderJob,
    ProviderOptions, RelightReport, lift_views, load_frames, metered_cameras, relight_by_provider,
    write_baked, write_pictures, write_scene,
};
use crate::lift::LiftOptions;
use crate::{Background, BakeOptions, LightOptions, QualityOptions, ViewTransform};
use anyhow::Context as _;
use clap::Parser;
use motes_formats::decomposition::SCENE_FILES;
use motes_stage::{CommonArgs, Context, HasCommon, StageError};
use render::frames::{PictureFormat, VideoOptions, ffmpeg_exists, run_ffmpeg, shell_words};
use serde::Serialize;

/// The G-buffer, the planes of light, their noise and what a picture is made of.
const PICTURE_BYTES_PER_PIXEL: u64 = 256;

const EXAMPLES: &str = "\
Examples:
  The held-out views under a low sun and the sky:
    relight --scene scene/ --capture c.json --split test --sun azimuth=90,elevation=8 --sky -o am/
  A turntable of the light of an environment map, from one view:
    relight --scene scene/ --capture c.json --view a --environment map.exr --turntable 48 -o turn/
  A relit splat for any viewer:
    relight --scene scene/ --environment map.exr -o relit.ply
  Views that another program relit, lifted to 3D:
    relight --from-images relit/ --gaussians gaussians.ply --capture c.json -o relit.ply
  Views that a learned model relights, lifted to 3D:
    relight --provider iclight --prompt 'warm light' --gaussians g.ply --capture c.json -o lit.ply";

/// Relight a decomposed scene, or lift relit views to 3D
#[derive(Parser, Debug, Serialize)]
#[command(name = "relight", after_help = EXAMPLES, mut_group("FrameSelection", |group| group.required(false)))]
pub struct Args {
    /// Scene folder written by decompose, relight or edit
    #[arg(long, value_name = "DIR", required_unless_present_any = ["from_images", "provider"])]
    scene: Option<PathBuf>,

    /// Capture that gives cameras and poses
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,

    /// Gaussians that relit views are lifted to (PLY), with --from-images or --provider
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    gaussians: Option<PathBuf>,

    /// Folder of relit images, named after the views
    #[arg(long, value_name = "DIR", requires_all = ["gaussians", "capture"], conflicts_with_all = ["scene", "provider"])]
    from_images: Option<PathBuf>,

    /// Folder of the images, or a file NAME.ply for a splat
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,

    /// Product to write [default: a splat when the output ends in .ply, else pictures]
    #[arg(long = "as", value_enum, value_name = "PRODUCT", conflicts_with = "from_images")]
    product: Option<Product>,

    /// Seed of the random numbers
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    seed: u64,

    #[command(flatten)]
    #[serde(flatten)]
    light: LightOptions,

    #[command(flatten)]
    #[serde(flatten)]
    quality: QualityOptions,

    #[command(flatten)]
    #[serde(flatten)]
    poses: PoseOptions,

    #[command(flatten)]
    #[serde(flatten)]
    video: VideoOptions,

    /// Background: transparent, environment, captured, black, white or r,g,b from 0 to 1
    #[arg(long, value_name = "BACKGROUND", default_value = "environment", help_heading = "Image")]
    background: Background,

    /// From linear light to PNG: standard (clipped, sRGB-encoded) or agx (film-like)
    #[arg(long, value_enum, value_name = "TRANSFORM", default_value_t, help_heading = "Image")]
    view_transform: ViewTransform,

    /// PNG (8-bit sRGB), EXR (linear, with all components), or both
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t = PictureFormat::Png,
        help_heading = "Outputs")]
    format: PictureFormat,

    #[command(flatten)]
    #[serde(flatten)]
    bake: BakeOptions,

    #[command(flatten)]
    #[serde(flatten)]
    lift: LiftOptions,

    #[command(flatten)]
    #[serde(flatten)]
    provider: ProviderOptions,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "scene",
        "capture",
        "output",
        "environment",
        "sun",
        "sky",
        "quality",
        "split",
        "view",
        "turntable",
    ];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Without ffmpeg the pictures are the product, and the command makes a video of them elsewhere.
fn make_video(command: &[String], context: &Context) -> anyhow::Result<()> {
    if ffmpeg_exists() {
        return run_ffmpeg(command).context("cannot make the video");
    }
    let text = "ffmpeg cannot be run: there are pictures, but no video; install it, then:";
    context.warn(format!("{text} {}", shell_words(command)));
    Ok(())
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a gate that is not met, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let output = context.output(&args.output)?;
    if let (Some(images), Some(gaussians), Some(capture)) =
        (&args.from_images, &args.gaussians, &args.capture)
    {
        let job = LiftJob { capture, gaussians, images, options: &args.lift };
        return lift_views(&job, &output, context).map(|report| Outcome::Lifted(report.into()));
    }
    if args.provider.flags.provider.is_some() {
        let (Some(gaussians), Some(capture)) = (&args.gaussians, &args.capture) else {
            let text = "--provider relights views of --gaussians under the cameras of --capture";
            return Err(StageError::usage(text).help("give both, without --scene").into());
        };
        let (provider, lift, seed) = (&args.provider, &args.lift, args.seed);
        let job = ProviderJob { capture, gaussians, provider, lift, seed };
        let report = relight_by_provider(&job, &output, context)?;
        return Ok(Outcome::Lifted(report.into()));
    }
    let Some(scene) = &args.scene else {
        let text = "one of --scene, --from-images and --provider is needed";
        return Err(StageError::usage(text).into());
    };
    let is_ply = output.extension().is_some_and(|e| e == "ply");
    let product = args.product.unwrap_or(if is_ply { Product::Splat } else { Product::Pictures });
    if let Some(video) = &args.video.video {
        if product != Product::Pictures || args.format == PictureFormat::Exr {
            let cause = "--video is made of PNG pictures";
            return Err(StageError::usage(cause).help("leave out --as and --format exr").into());
        }
        context.output(video)?;
    }
    let frames = match product {
        Product::Pictures => load_frames(&args.poses, &args.video, args.capture.as_ref(), context)?,
        Product::Splat => Vec::new(),
        Product::Scene => {
            context.output_files(&output, &SCENE_FILES)?;
            Vec::new()
        }
    };
    let sizes = frames.iter().map(|(frame, _)| (frame.camera.width, frame.camera.height));
    context.need_memory_for_pictures(sizes, PICTURE_BYTES_PER_PIXEL)?;
    let loaded = LoadedScene::load(scene, context)?;
    let mut light = NewLight::load(&args.light, &loaded, context)?;
    let metered = metered_cameras(&frames, args.capture.as_ref(), context)?;
    light.meter(&metered, &args.quality, args.seed)?;
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
        view: args.view_transform,
        format: args.format,
        seed: args.seed,
    };
    match product {
        Product::Pictures => {
            write_pictures(&job, &output, &mut report, context)?;
            let is_numbered = args.poses.turntable.is_some() || args.video.numbers_frames();
            if is_numbered || args.poses.selection.path.is_some() {
                let command = args.video.command(&output);
                report.video_command = Some(shell_words(&command));
                if args.video.video.is_some() {
                    make_video(&command, context)?;
                }
            }
        }
        Product::Splat => write_baked(&job, &args.bake, &output, &mut report, context)?,
        Product::Scene => write_scene(&job, &args.bake, &output, &mut report, context)?,
    }
    Ok(Outcome::Relit(report.into()))
}
