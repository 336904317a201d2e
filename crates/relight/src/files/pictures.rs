//! Pictures under a light, and their files.

use std::path::Path;

use crate::{
    Background, Components, Picture, PictureStats, QualityOptions, Relighter, ViewTransform,
};
use motes_formats::exr_aov::{AovChannel, write_finite_exr};
use motes_formats::images::write_png;
use motes_scene::ImageF32;
use motes_stage::Context;
use render::frames::PictureFormat;

use super::frames::LitFrame;
use super::{LoadedScene, NewLight, RelightReport};

/// Largest half float: brighter values are written as floats.
const HALF_MAX: f32 = 65_504.0;
/// More than that of the scene above white is warned of.
const MAX_CLIPPED_SHARE: f64 = 0.01;

/// What is rendered.
pub struct PictureJob<'a> {
    /// The scene.
    pub loaded: &'a LoadedScene,
    /// The light.
    pub light: &'a NewLight<'a>,
    /// Poses, each with a turn of the light.
    pub frames: &'a [LitFrame],
    /// Time against noise.
    pub quality: &'a QualityOptions,
    /// Behind the scene.
    pub background: Background,
    /// From linear light to PNG.
    pub view: ViewTransform,
    /// Files per picture.
    pub format: PictureFormat,
    /// Of random numbers.
    pub seed: u64,
}

/// Renders and writes all pictures and fills in the report.
///
/// # Errors
/// When a light is out of range, a file cannot be written, or the user interrupts.
pub fn write_pictures(
    job: &PictureJob<'_>,
    folder: &Path,
    report: &mut RelightReport,
    context: &Context,
) -> anyhow::Result<()> {
    let progress = context.progress("relighting", job.frames.len() as u64);
    let cpu = || context.cpu_seconds().unwrap_or(f64::NAN);
    let (mut lights, mut light_seconds, mut picture_seconds) = (0, 0.0, 0.0);
    let mut sums = PictureStats::default();
    let scene = &job.loaded.scene;
    let mut at = 0;
    while at < job.frames.len() {
        // Frames of one turn share the light that surfaces send on.
        let turn = job.frames[at].1;
        let end = at + job.frames[at..].iter().take_while(|(_, t)| *t == turn).count();
        let start = cpu();
        let light = job.light.turned(turn)?;
        let relighter =
            Relighter::new(scene, &light.environment, job.quality, job.seed).with_view(job.view);
        light_seconds += cpu() - start;
        report.residual_share +=
            relighter.residual_share() * (end - at) as f32 / job.frames.len() as f32;
        report.sky_replaced |= relighter.replaces_sky(job.background);
        lights += 1;
        for (frame, _) in &job.frames[at..end] {
            context.check_interrupted()?;
            let start = cpu();
            let (camera, pose) = (&frame.camera, &frame.camera_from_world);
            let exr = job.format != PictureFormat::Png;
            let picture = relighter.picture(camera, pose, job.background, exr);
            picture_seconds += cpu() - start;
            write_picture(folder, &frame.name, &picture, job.format)?;
            add(&mut sums, &picture.stats);
            progress.inc(1);
        }
        at = end;
    }
    let n = job.frames.len().max(1) as f64;
    report.pictures = job.frames.len();
    report.picture_means = Some(PictureStats {
        noise_rms: sums.noise_rms / n,
        unobserved_share: sums.unobserved_share / n,
        missed_share: sums.missed_share / n,
        clipped_share: sums.clipped_share / n,
    });
    warn_of_clipping(job, sums.clipped_share / n, context);
    report.cpu_seconds_per_light =
        Some(light_seconds / f64::from(lights.max(1))).filter(|s| s.is_finite());
    report.cpu_seconds_per_picture = Some(picture_seconds / n).filter(|s| s.is_finite());
    Ok(())
}

/// A film-like curve has no value that it clips, and EXR files keep everything.
fn warn_of_clipping(job: &PictureJob<'_>, share: f64, context: &Context) {
    let is_clipped = job.view != ViewTransform::Agx && job.format != PictureFormat::Exr;
    if is_clipped && share > MAX_CLIPPED_SHARE {
        context.warn(format!(
            "{:.1} % of the scene in the pictures is brighter than white and clipped: \
             see --exposure-compensation, --view-transform agx, --format exr",
            100.0 * share
        ));
    }
}

fn add(sums: &mut PictureStats, one: &PictureStats) {
    sums.noise_rms += one.noise_rms;
    sums.unobserved_share += one.unobserved_share;
    sums.missed_share += one.missed_share;
    sums.clipped_share += one.clipped_share;
}

fn write_picture(
    folder: &Path,
    name: &str,
    picture: &Picture,
    format: PictureFormat,
) -> anyhow::Result<()> {
    if format != PictureFormat::Exr {
        write_png(&folder.join(format!("{name}.png")), &picture.color)?;
    }
    if let Some(components) = &picture.components {
        let (width, height) = (components.alpha.width, components.alpha.height);
        let attributes = [
            ("colorSpace", "linear Rec.709 / sRGB primaries, photo units: radiance times exposure"),
            ("depthUnit", "world units along the camera z axis; 0 = nothing"),
            ("normalSpace", "world"),
            ("generator", concat!("motes ", env!("CARGO_PKG_VERSION"))),
        ]
        .map(|(k, v)| (k.to_owned(), v.to_owned()));
        let path = folder.join(format!("{name}.exr"));
        write_finite_exr(&path, width, height, &channels(components), &attributes)?;
    }
    Ok(())
}

fn channels(picture: &Components) -> Vec<AovChannel> {
    let mut channels = Vec::new();
    let plane = |image: &ImageF32, c: usize| -> Vec<f32> {
        image.data.iter().skip(c).step_by(image.channels).copied().collect()
    };
    let mut color = |layer: &str, names: [&str; 3], image: &ImageF32| {
        let fits = image.data.iter().all(|v| v.abs() <= HALF_MAX);
        for (c, name) in names.into_iter().enumerate() {
            let (name, values) = (format!("{layer}{name}"), plane(image, c));
            channels.push(match fits {
                true => AovChannel::half(name, &values),
                false => AovChannel::float(name, values),
            });
        }
    };
    let rgb = ["R", "G", "B"];
    color("", rgb, &picture.color_linear);
    color("diffuse.", rgb, &picture.diffuse);
    color("specular.", rgb, &picture.specular);
    color("indirect.", rgb, &picture.indirect);
    color("base_color.", rgb, &picture.base_color);
    for (name, image) in [
        ("A", &picture.alpha),
        ("visibility.V", &picture.visibility),
        ("roughness.V", &picture.roughness),
        ("metallic.V", &picture.metallic),
    ] {
        channels.push(AovChannel::half(name, &plane(image, 0)));
    }
    channels.push(AovChannel::float("depth.Z", plane(&picture.depth, 0)));
    for (c, name) in ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate() {
        channels.push(AovChannel::float(name, plane(&picture.normal, c)));
    }
    channels
}
