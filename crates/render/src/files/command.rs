//! Arguments of `render` and what happens to them.

use std::path::{Path, PathBuf};

use super::ChosenFrames;
use super::FrameWriter;
use super::MaskFlags;
use super::around::{Direction, around_model, parse_direction};
use crate::frames::{
    BetweenOptions, Frame, FrameFiles, FrameFormat, FrameLook, FrameSelection, FrameSize,
    RenderReport, VideoOptions, ffmpeg_exists, numbered, run_ffmpeg, shell_words,
};
use crate::model::{Model, ModelInput};
use anyhow::Context as _;
use clap::Parser;
use motes_scene::{Gaussians, Materials};
use motes_stage::{CommonArgs, Context, HasCommon, StageError};
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  The held-out views of a capture:
    render --gaussians gaussians.ply --capture capture.json --split test -o test/
  One view with depth, normals and alpha as linear EXR:
    render --gaussians gaussians.ply --capture capture.json --view p03 --format exr -o aovs/
  Once around Gaussians of any program, without a capture:
    render --gaussians any.ply --orbit 60 --up 0,0,1 -o around/
  A video of an orbit around the object (needs ffmpeg):
    render --gaussians gaussians.ply --capture capture.json --orbit 120 --video orbit.mp4 -o out/";

/// Render Gaussians from the views of a capture, poses between them, orbits or camera paths
#[derive(Parser, Debug, Serialize)]
#[command(name = "render", after_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    #[serde(flatten)]
    input: ModelInput,

    /// Capture that gives cameras and poses
    #[arg(long, value_name = "FILE", required_unless_present_any = ["path", "orbit"])]
    capture: Option<PathBuf>,

    /// Direction up of an orbit without a capture, x,y,z; default 0,-1,0, about that of COLMAP's worlds
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_direction,
        allow_hyphen_values = true, conflicts_with = "capture", help_heading = "Cameras")]
    up: Option<Direction>,

    /// Folder of the images to write
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    #[command(flatten)]
    #[serde(flatten)]
    selection: FrameSelection,

    #[command(flatten)]
    #[serde(flatten)]
    between: BetweenOptions,

    #[command(flatten)]
    #[serde(flatten)]
    look: FrameLook,

    #[command(flatten)]
    #[serde(flatten)]
    size: FrameSize,

    #[command(flatten)]
    #[serde(flatten)]
    format: FrameFormat,

    #[command(flatten)]
    #[serde(flatten)]
    objects: MaskFlags,

    #[command(flatten)]
    #[serde(flatten)]
    video: VideoOptions,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "gaussians",
        "scene",
        "capture",
        "output",
        "split",
        "view",
        "orbit",
        "path",
        "format",
        "video",
    ];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a gate that is not met, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<RenderReport> {
    let output = context.output(&args.output)?;
    let files = FrameFiles::new(&args.format);
    if let Some(video) = &args.video.video {
        context.output(video)?;
        if !files.png || !ffmpeg_exists() {
            return Err(StageError::usage("--video needs PNG files and ffmpeg, which can be run")
                .help("take --format png and install ffmpeg, or take --video-frames")
                .into());
        }
    }
    let chosen = ChosenFrames {
        capture: args.capture.as_deref(),
        selection: &args.selection,
        between: &args.between,
        size: &args.size,
        video: &args.video,
    };
    let around = args.selection.orbit.filter(|_| args.capture.is_none());
    let gaussians = args.input.file()?;
    let load = || -> anyhow::Result<Model> {
        context.input("gaussians", &gaussians)?;
        let model = Model::load(&gaussians, args.look.antialias)?;
        if let Some(scene) = &args.input.scene {
            warn_of_mirrors(&model.gaussians, scene, context);
        }
        Ok(model)
    };
    let enough = |frames: &[Frame]| {
        context.need_memory(args.look.memory_bytes(frames, &args.size), "take a smaller --width")
    };
    let (frames, model) = if let Some(count) = around {
        let model = load()?;
        let frames = around_model(&model.gaussians, args.up, &args.size, count)?;
        enough(&frames)?;
        (frames, model)
    } else {
        let frames = chosen.load(context)?;
        enough(&frames)?;
        (frames, load()?)
    };
    let projection = (files.exr, args.look.projection);
    let objects = args.objects.load(&args.input, &model, projection, context)?;
    let matte = args.look.options(&model, false);
    context.stop_if_dry_run()?;

    let mut writer = FrameWriter::new(&output, files, args.format.depth_range);
    writer.attributes = objects.attributes();
    let progress = context.progress("rendering", frames.len() as u64);
    let before = context.elapsed_seconds();
    let cpu = || context.cpu_seconds().unwrap_or(f64::NAN);
    let mut cpu_seconds = 0.0;
    for frame in &frames {
        context.check_interrupted()?;
        let start = cpu();
        if !objects.write_mask(&output, &model, frame, &matte)? {
            let rendering = args.look.render(&model, frame, &args.size, writer.needs_aovs());
            let mattes = objects.channels(&model, frame, &matte);
            writer.write_with(&frame.name, &rendering, mattes)?;
        }
        cpu_seconds += cpu() - start;
        progress.inc(1);
    }
    drop(progress);
    let seconds = context.elapsed_seconds() - before;
    let command = args.video.command(&output);
    if args.video.video.is_some() {
        run_ffmpeg(&command).context("cannot make the video")?;
    }
    let is_video = frames.len() > 1 && frames.iter().zip(0..).all(|(f, i)| f.name == numbered(i));
    Ok(RenderReport {
        pictures: frames.len(),
        gaussians: model.gaussians.len(),
        output,
        seconds_per_picture: seconds / frames.len().max(1) as f64,
        cpu_seconds_per_picture: Some(cpu_seconds / frames.len().max(1) as f64)
            .filter(|s| s.is_finite()),
        video_command: is_video.then(|| shell_words(&command)),
    })
}

/// Roughness and metallic from which reflections are sharper than the harmonics of a color can hold.
const MIRROR_ROUGHNESS: f32 = 0.3;
const MIRROR_METALLIC: f32 = 0.5;
/// Share of the Gaussians that is worth a warning.
const WORTH_A_WARNING: f64 = 0.005;

/// Says that colors of Gaussians do not show what polished metal reflects.
fn warn_of_mirrors(gaussians: &Gaussians, scene: &Path, context: &Context) {
    let Ok(materials) = Materials::of(gaussians) else { return };
    let of = |(roughness, metallic): &(&f32, &f32)| {
        **roughness < MIRROR_ROUGHNESS && **metallic > MIRROR_METALLIC
    };
    let count = materials.roughness.iter().zip(&materials.metallic).filter(of).count();
    if count as f64 > WORTH_A_WARNING * gaussians.len() as f64 {
        context.warn(format!(
            "{count} Gaussians are of polished metal: their colors are too smooth for what it \
             reflects; relight --scene {} with the same views shades it under the same light",
            scene.display()
        ));
    }
}
