//! Views relit by a learned model in a program of its own, then lifted onto the Gaussians.

use std::path::{Path, PathBuf};

use clap::Args;
use motes_codecs::open_gaussians;
use motes_formats::atomic::ScratchFolder;
use motes_formats::capture::read_capture;
use motes_formats::images::{read_image, write_png};
use motes_formats::provider::{
    ProviderKind, ProviderRequest, RelightResult, RelightTask, Task, TaskResult,
};
use motes_math::resample::{Filter, resize_rows};
use motes_protocol::{Provider, ProviderFlags};
use motes_raster::{RenderOptions, render};
use motes_scene::{Capture, ImageF32, ImageU8, Pinhole, Split};
use motes_stage::{Context, StageError};
use render::frames::{pinhole_of, view_stems};
use serde::Serialize;

use super::lift::{LiftReport, antialias_of, write_lifted};
use crate::lift::{LiftOptions, RelitView};

/// Alpha from which a pixel counts as the object that is lit.
const OPAQUE: f32 = 0.5;

/// What a provider is told.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Provider (expert)")]
pub struct ProviderOptions {
    /// Which one.
    #[command(flatten)]
    #[serde(flatten)]
    pub flags: ProviderFlags,

    /// The new light in words, for --provider
    #[arg(long, value_name = "TEXT", requires = "provider")]
    pub prompt: Option<String>,

    /// Picture whose light the provider takes, cut to the shape of each view
    #[arg(long, value_name = "FILE", requires = "provider")]
    pub background_picture: Option<PathBuf>,

    /// Training views that the provider relights, evenly spread; 0: all
    #[arg(long, value_name = "COUNT", default_value_t = 12)]
    pub provider_views: u32,

    /// Longer side of the pictures that the provider gets, pixels, at most that of the photos
    #[arg(long, value_name = "PIXELS", default_value_t = 512,
        value_parser = clap::value_parser!(u32).range(16..=8192))]
    pub provider_size: u32,

    /// Folder for the pictures that the provider made
    #[arg(long, value_name = "DIR", requires = "provider")]
    pub provider_pictures: Option<PathBuf>,
}

/// The inputs.
pub struct ProviderJob<'a> {
    /// Cameras and poses.
    pub capture: &'a Path,
    /// What is relit.
    pub gaussians: &'a Path,
    /// Who relights it, and what it is told.
    pub provider: &'a ProviderOptions,
    /// How its pictures come onto the Gaussians.
    pub lift: &'a LiftOptions,
    /// For models that draw random numbers: the same for every view.
    pub seed: u64,
}

/// Renders views, has them relit, and lifts the pictures onto the Gaussians.
///
/// # Errors
/// When a file is missing or malformed, the provider fails or answers what nobody asked for, or the user asked to stop.
pub fn relight_by_provider(
    job: &ProviderJob<'_>,
    output: &Path,
    context: &Context,
) -> anyhow::Result<LiftReport> {
    let options = job.provider;
    if options.prompt.is_none() && options.background_picture.is_none() {
        let text = "the provider is not told which light";
        let help = "give --prompt TEXT, --background-picture FILE, or both";
        return Err(StageError::usage(text).help(help).into());
    }
    context.input("capture", job.capture)?;
    context.input("gaussians", job.gaussians)?;
    if let Some(picture) = &options.background_picture {
        context.input("background picture", picture)?;
    }
    let kept = match &options.provider_pictures {
        Some(folder) => Some(context.output(folder)?),
        None => None,
    };
    let command = options.flags.command(context)?;
    let Some(command) = command else { return Err(StageError::usage("no --provider").into()) };
    let capture = read_capture(job.capture)?;
    let file = open_gaussians(job.gaussians)?;
    let background = match &options.background_picture {
        Some(path) => Some(read_image(path)?),
        None => None,
    };
    context.stop_if_dry_run()?;
    let mut provider = options.flags.open(command, ProviderKind::Relight, context)?;
    let chosen = chosen_views(&capture, options.provider_views);
    let stems = view_stems(&capture);
    let progress = context.progress("relighting views", chosen.len() as u64);
    let mut views = Vec::with_capacity(chosen.len());
    for (done, &view) in chosen.iter().enumerate() {
        context.check_interrupted()?;
        let full = pinhole_of(&capture, view).map_err(anyhow::Error::from)?;
        let camera = limited(&full, options.provider_size as usize);
        let pose = capture.views[view].camera_from_world;
        let rendering =
            RenderOptions { antialias: antialias_of(&file), ..RenderOptions::default() };
        let drawn = render(&file.gaussians, &camera, &pose, &rendering);
        let asked =
            Asked { color: &drawn.color, alpha: &drawn.alpha, background: background.as_ref() };
        let picture = asked.relit(&mut provider, options.prompt.as_deref(), job.seed, context)?;
        if let Some(folder) = &kept {
            std::fs::create_dir_all(folder)?;
            write_png(&folder.join(format!("{}.png", stems[view])), &picture)?;
        }
        views.push(RelitView {
            name: capture.views[view].name.clone(),
            camera,
            camera_from_world: pose,
            picture: rgb(&picture),
            mask: Some(drawn.alpha),
        });
        progress.set(done as u64 + 1);
    }
    let without = capture.views.len() - views.len();
    let mut report = write_lifted(&file, &views, without, job.lift, output, context)?;
    report.provider = Some(provider.used().clone());
    Ok(report)
}

/// What goes to the provider for one view.
struct Asked<'a> {
    color: &'a ImageF32,
    alpha: &'a ImageF32,
    background: Option<&'a ImageU8>,
}

impl Asked<'_> {
    fn relit(
        &self,
        provider: &mut Provider,
        prompt: Option<&str>,
        seed: u64,
        context: &Context,
    ) -> anyhow::Result<ImageU8> {
        let scratch = ScratchFolder::new()?;
        let folder = scratch.path();
        write_png(&folder.join("picture.png"), &self.color.to_u8())?;
        let is_object = |a: &f32| if *a >= OPAQUE { 255 } else { 0 };
        let mask: Vec<u8> = self.alpha.data.iter().map(is_object).collect();
        // A view that the scene fills has no background.
        let foreground = mask.contains(&0).then(|| "foreground.png".to_owned());
        if let Some(name) = &foreground {
            let mask = ImageU8::from_data(self.alpha.width, self.alpha.height, 1, mask);
            write_png(&folder.join(name), &mask)?;
        }
        let background = self.background.map(|_| "background.png".to_owned());
        if let (Some(name), Some(picture)) = (&background, self.background) {
            write_png(&folder.join(name), &cut(picture, self.color.width, self.color.height))?;
        }
        let task = RelightTask {
            picture: "picture.png".into(),
            foreground,
            background,
            prompt: prompt.unwrap_or_default().to_owned(),
        };
        let request = ProviderRequest::new(Task::Relight(task), seed);
        let reply = provider.ask(folder, &request, &|| context.interrupted())?;
        reply.warnings.iter().for_each(|warning| context.warn(warning.clone()));
        let TaskResult::Relight(RelightResult { picture }) = &reply.result else {
            anyhow::bail!("the provider answered another kind");
        };
        Ok(read_image(&folder.join(picture))?)
    }
}

/// Training views of a pinhole camera, `count` of them evenly spread; 0: all.
fn chosen_views(capture: &Capture, count: u32) -> Vec<usize> {
    let train: Vec<usize> = capture
        .views_of(Split::Train)
        .into_iter()
        .filter(|&view| pinhole_of(capture, view).is_ok())
        .collect();
    match count as usize {
        0 => train,
        count if count >= train.len() => train,
        count => (0..count).map(|i| train[i * train.len() / count]).collect(),
    }
}

fn limited(camera: &Pinhole, longer_side: usize) -> Pinhole {
    let longer = camera.width.max(camera.height);
    if longer <= longer_side {
        return *camera;
    }
    let side = |pixels: usize| (pixels * longer_side).div_ceil(longer).max(1);
    camera.resized(side(camera.width), side(camera.height))
}

/// The middle of a picture in another shape, RGB.
fn cut(picture: &ImageU8, width: usize, height: usize) -> ImageU8 {
    let scale = (picture.width as f64 / width as f64).min(picture.height as f64 / height as f64);
    let side = |pixels: usize, most: usize| ((pixels as f64 * scale) as usize).clamp(1, most);
    let (w, h) = (side(width, picture.width), side(height, picture.height));
    let (left, top) = ((picture.width - w) / 2, (picture.height - h) / 2);
    let source = rgb(picture);
    let data = resize_rows((w, h, 3), (width, height), Filter::Triangle, |y, row| {
        let first = 3 * ((top + y) * source.width + left);
        row.copy_from_slice(&source.data[first..first + 3 * w]);
    });
    ImageF32::from_data(width, height, 3, data).to_u8()
}

fn rgb(picture: &ImageU8) -> ImageF32 {
    let pixels = picture.to_f32();
    let channels = pixels.channels;
    let data = match channels {
        1 | 2 => pixels.data.chunks_exact(channels).flat_map(|p| [p[0]; 3]).collect(),
        _ => pixels.data.chunks_exact(channels).flat_map(|p| [p[0], p[1], p[2]]).collect(),
    };
    ImageF32::from_data(picture.width, picture.height, 3, data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_cut_around_its_middle() {
        // Columns 0 to 7, gray 10 x; the middle half of the width is what a tall view keeps.
        let wide = ImageU8::from_data(8, 4, 1, (0..32).map(|i| 10 * (i % 8) as u8).collect());
        let tall = cut(&wide, 2, 4);
        assert_eq!((tall.width, tall.height, tall.channels), (2, 4, 3));
        assert_eq!(tall.pixel(0, 0), [30; 3]);
        assert_eq!(tall.pixel(1, 3), [40; 3]);
        assert_eq!(cut(&wide, 1, 1).pixel(0, 0), [35; 3]);
        assert_eq!(cut(&ImageU8::filled(1, 1, 4, 9), 3, 2), ImageU8::filled(3, 2, 3, 9));
    }
}
