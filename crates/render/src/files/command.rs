//! Render Gaussians as pictures: views of a capture, poses between them, orbits, camera paths.
//!
//! Inputs: Gaussians (PLY) or a scene folder; a capture (`motes/capture` 1.x) or a camera path
//! (`motes/camera-path` 1.x). Output: a folder of PNG or multi-channel EXR files.
//!
//! ```text
//! render --capture OUT/capture.json --gaussians gaussians.ply --split test -o renders/
//! render --capture OUT/capture.json --gaussians gaussians.ply --between a.jpg b.jpg -o half/
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/render.md`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::Parser;
use motes_report::frames::{
    BetweenOptions, FrameFiles, FrameFormat, FrameLook, FrameSelection, FrameSize, FrameWriter,
    RenderReport, VideoOptions, ffmpeg_exists, numbered, run_ffmpeg, shell_words,
};
use motes_report::model::{Model, ModelInput};
use motes_stage::{CommonArgs, Context, HasCommon, StageError};
use motes_stages::rendering::ChosenFrames;
use motes_stages::selecting::MaskFlags;
use serde::Serialize;

/// Render Gaussians as pictures: views of a capture, poses between them, orbits, camera paths
#[derive(Parser, Debug, Serialize)]
#[command(name = "render")]
struct Args {
    #[command(flatten)]
    #[serde(flatten)]
    input: ModelInput,

    /// Capture that gives cameras and poses
    #[arg(long, value_name = "FILE", required_unless_present = "path")]
    capture: Option<PathBuf>,

    /// Folder for the pictures
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
    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

fn main() -> ExitCode {
    motes_stage::main(run)
}

fn run(args: &Args, context: &Context) -> anyhow::Result<RenderReport> {
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
    let frames = chosen.load(context)?;
    context.need_memory(args.look.memory_bytes(&frames, &args.size), "take a smaller --width")?;
    let gaussians = args.input.file()?;
    context.input("gaussians", &gaussians)?;
    let model = Model::load(&gaussians, args.look.antialias)?;
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
