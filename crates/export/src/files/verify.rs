//! Reads the product again and compares its pictures with those of the source.

use std::fmt;
use std::path::Path;

use clap::Args;
use glam::DVec3;
use motes_codecs::{SplatFormat, open_gaussians};
use motes_formats::capture::read_capture;
use motes_formats::ply::{GaussianFile, RenderMode};
use motes_formats::standard_stream::is_standard_stream;
use motes_math::metrics::psnr_f32;
use motes_raster::{Antialias, RenderOptions, render};
use motes_scene::{Gaussians, Pinhole, Pose};
use motes_stage::{Context, OrBadInput as _, StageError};
use render::frames::{Frame, FrameSource, plan_frames};
use serde::Serialize;

/// Pixels of the longer side of a picture.
const LONGER_SIDE: usize = 640;
/// An orbit sees a sphere of this many standard deviations of the centers, weighted by opacity.
const ORBIT_DEVIATIONS: f64 = 2.0;

/// The flags of the comparison.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Verification")]
pub struct VerifyOptions {
    /// Read the product again and compare its renderings with those of the source
    #[arg(long)]
    pub verify: bool,

    /// Number of views to compare
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub verify_views: u32,

    /// Fail (exit code 4) below this PSNR in dB
    #[arg(long, value_name = "DB", requires = "verify")]
    pub min_psnr: Option<f64>,
}

impl VerifyOptions {
    /// Refuses what cannot be read again.
    ///
    /// # Errors
    /// A usage error.
    pub fn check(&self, format: SplatFormat, output: &Path) -> Result<(), StageError> {
        if self.verify && (!format.codec().is_readable() || is_standard_stream(output)) {
            let text = format!("--verify reads the product, and {} cannot be", output.display());
            return Err(StageError::usage(text).help("take a file of a format that can be read"));
        }
        Ok(())
    }
}

/// What the comparison found.
#[derive(Clone, Debug, Serialize)]
pub struct VerifyReport {
    /// Pictures.
    pub views: usize,
    /// PSNR of the mean squared error over all pictures, dB; null when they are equal.
    pub psnr_db: Option<f64>,
    /// The worst picture, dB; null when all are equal.
    pub worst_psnr_db: Option<f64>,
    /// Gaussians read back.
    pub gaussians: usize,
    /// CPU seconds of all threads for reading; null where the system does not tell.
    pub cpu_seconds_read: Option<f64>,
}

impl fmt::Display for VerifyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.psnr_db, self.worst_psnr_db) {
            (Some(psnr), Some(worst)) => write!(
                f,
                "{} pictures of the product: {psnr:.2} dB against the source, the worst {worst:.2}",
                self.views
            ),
            _ => write!(f, "{} pictures of the product are those of the source", self.views),
        }
    }
}

/// Reads `product` and compares, through the cameras of `capture`, or on an orbit.
///
/// # Errors
/// When the product or the capture cannot be read.
pub fn verify(
    source: &GaussianFile,
    product: &Path,
    options: &VerifyOptions,
    capture: Option<&Path>,
    context: &Context,
) -> anyhow::Result<VerifyReport> {
    let count = options.verify_views as usize;
    let frames = match capture {
        Some(capture) => captured(capture, count, context)?,
        None => orbit(&source.gaussians, count),
    };
    let start = context.cpu_seconds();
    let again = open_gaussians(product)?;
    let cpu_seconds_read = start.zip(context.cpu_seconds()).map(|(a, b)| b - a);
    let mut errors = Vec::new();
    for frame in &frames {
        context.check_interrupted()?;
        let (truth, found) = (picture(source, frame), picture(&again, frame));
        // Infinite PSNR is an error of 0.
        errors.push(10f64.powf(-psnr_f32(&truth, &found) / 10.0));
    }
    let decibels = |mse: f64| (mse > 0.0).then(|| -10.0 * mse.log10());
    let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    let report = VerifyReport {
        views: frames.len(),
        psnr_db: decibels(mean),
        worst_psnr_db: decibels(errors.iter().copied().fold(0.0, f64::max)),
        gaussians: again.gaussians.len(),
        cpu_seconds_read,
    };
    if let (Some(least), Some(psnr)) = (options.min_psnr, report.psnr_db)
        && !(psnr >= least)
    {
        context.gate_not_met(format!("the product has {psnr:.2} dB, --min-psnr asks for {least}"));
    }
    Ok(report)
}

/// Values of a picture as an 8-bit screen would show them before rounding: 0 to 1.
fn picture(file: &GaussianFile, frame: &Frame) -> Vec<f32> {
    let mip = file.render_mode == Some(RenderMode::Mip);
    let antialias = if mip { Antialias::Mip } else { Antialias::Classic };
    let options = RenderOptions { antialias, ..RenderOptions::default() };
    let rendering = render(&file.gaussians, &frame.camera, &frame.camera_from_world, &options);
    rendering.color.data.iter().map(|v| v.clamp(0.0, 1.0)).collect()
}

/// Views of a capture, evenly chosen, at most 640 pixels wide and high.
fn captured(capture: &Path, count: usize, context: &Context) -> anyhow::Result<Vec<Frame>> {
    context.input("capture", capture)?;
    let capture = read_capture(capture)?;
    let all = plan_frames(&capture, &FrameSource::Split(None)).or_bad_input()?;
    let every = all.len().div_ceil(count).max(1);
    let mut frames: Vec<Frame> = all.into_iter().step_by(every).collect();
    for frame in &mut frames {
        let longer = frame.camera.width.max(frame.camera.height);
        if longer > LONGER_SIDE {
            let scale = LONGER_SIDE as f64 / longer as f64;
            let side = |pixels: usize| ((pixels as f64 * scale).round() as usize).max(1);
            frame.camera =
                frame.camera.resized(side(frame.camera.width), side(frame.camera.height));
        }
    }
    Ok(frames)
}

/// Cameras on a circle that see the bulk of the opacity, up being -y, as PLY files have it.
fn orbit(gaussians: &Gaussians, count: usize) -> Vec<Frame> {
    let weight = |i: usize| f64::from(motes_math::sigmoid::sigmoid(gaussians.opacity_logits[i]));
    let mean = |i: usize| DVec3::from_array(gaussians.means[i].map(f64::from));
    let rows = || (0..gaussians.len()).filter(|i| mean(*i).is_finite());
    let total: f64 = rows().map(weight).sum::<f64>().max(f64::MIN_POSITIVE);
    let center = rows().map(|i| weight(i) * mean(i)).sum::<DVec3>() / total;
    let variance =
        rows().map(|i| weight(i) * mean(i).distance_squared(center)).sum::<f64>() / total;
    let radius = (ORBIT_DEVIATIONS * variance.sqrt()).max(1e-6);
    let side = LONGER_SIDE;
    let focal = side as f64;
    let half = focal / 2.0;
    let camera = Pinhole { width: side, height: side, fx: focal, fy: focal, cx: half, cy: half };
    let frame = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / count as f64;
        // At 2.24 radii a field of view of 53 degrees holds the sphere.
        let offset = DVec3::new(angle.sin(), -0.4, angle.cos()).normalize() * 2.24 * radius;
        let pose = Pose::look_at(center + offset, center, DVec3::NEG_Y)?;
        Some(Frame {
            name: format!("orbit-{i}"),
            camera,
            camera_from_world: pose,
            exposure_stops: None,
        })
    };
    (0..count).filter_map(frame).collect()
}
