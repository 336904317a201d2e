//! Relit views from a folder, lifted onto Gaussians.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};

use crate::lift::{Agreement, LiftMethod, LiftOptions, RelitView, ViewAgreement, lift};
use motes_codecs::open_gaussians;
use motes_formats::capture::{read_capture, resolve};
use motes_formats::images::{read_image, read_mask};
use motes_formats::ply::{GaussianFile, PlyWriteOptions, RenderMode, write_gaussians};
use motes_protocol::ProviderUse;
use motes_raster::Antialias;
use motes_scene::{Capture, ImageF32};
use motes_stage::{Context, OrBadInput as _, StageError};
use render::frames::{pinhole_of, view_stems};
use serde::Serialize;

/// Suffixes that a relit picture may have.
const SUFFIXES: [&str; 7] = ["png", "jpg", "jpeg", "webp", "tif", "tiff", "bmp"];
/// Views that weigh less are named in a warning.
const DISTRUST: f32 = 0.3;

/// The inputs.
pub struct LiftJob<'a> {
    /// Cameras, poses and masks.
    pub capture: &'a Path,
    /// What is relit.
    pub gaussians: &'a Path,
    /// Pictures named after views.
    pub images: &'a Path,
    /// Parameters.
    pub options: &'a LiftOptions,
}

/// What was lifted.
#[derive(Clone, Debug, Serialize)]
pub struct LiftReport {
    /// The file.
    pub output: PathBuf,
    /// Vote, or vote and fit.
    pub lift: LiftMethod,
    /// Majority or mean.
    pub agreement: Agreement,
    /// Number of Gaussians.
    pub gaussians: usize,
    /// Gaussians that no relit view saw; they took the median change.
    pub unseen_gaussians: usize,
    /// Views of the capture without a picture.
    pub views_without_picture: usize,
    /// How each view stands to the others.
    pub views: Vec<ViewAgreement>,
    /// Root mean square error of the views at the first and the last step of a refit, sRGB-encoded.
    pub refit_rms: Option<[f64; 2]>,
    /// Of all threads.
    pub cpu_seconds: Option<f64>,
    /// Who relit the views, where a provider did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub provider: Option<ProviderUse>,
}

/// Reads the views, lifts them and writes the Gaussians.
///
/// # Errors
/// When a file is missing or malformed, or no picture belongs to a view.
pub fn lift_views(
    job: &LiftJob<'_>,
    output: &Path,
    context: &Context,
) -> anyhow::Result<LiftReport> {
    context.input("capture", job.capture)?;
    context.input("gaussians", job.gaussians)?;
    context.input("images", job.images)?;
    let capture = read_capture(job.capture)?;
    let file = open_gaussians(job.gaussians)?;
    let found = find_pictures(&capture, job.images, context)?;
    context.stop_if_dry_run()?;
    let mut views = Vec::with_capacity(found.len());
    for (view, path) in &found {
        context.check_interrupted()?;
        views.push(load_view(&capture, job.capture, *view, path)?);
    }
    let without = capture.views.len() - found.len();
    write_lifted(&file, &views, without, job.options, output, context)
}

/// How the Gaussians of a file are drawn.
pub(super) fn antialias_of(file: &GaussianFile) -> Antialias {
    match file.render_mode {
        Some(RenderMode::Mip) => Antialias::Mip,
        _ => Antialias::Classic,
    }
}

/// Lifts views onto the Gaussians of a file and writes these.
pub(super) fn write_lifted(
    file: &GaussianFile,
    views: &[RelitView],
    views_without_picture: usize,
    options: &LiftOptions,
    output: &Path,
    context: &Context,
) -> anyhow::Result<LiftReport> {
    let cpu = || context.cpu_seconds().unwrap_or(f64::NAN);
    let start = cpu();
    let lifted = lift(&file.gaussians, antialias_of(file), views, options);
    let cpu_seconds = Some(cpu() - start).filter(|s| s.is_finite());
    for view in lifted.views.iter().filter(|v| v.weight < DISTRUST) {
        context.warn(format!(
            "{} disagrees with the other views by {:.2} stops and counts little (weight {:.2})",
            view.name, view.disagreement_stops, view.weight
        ));
    }
    let written = PlyWriteOptions { render_mode: file.render_mode, ..PlyWriteOptions::default() };
    write_gaussians(output, &lifted.gaussians, &written)?;
    Ok(LiftReport {
        output: output.to_owned(),
        lift: options.lift,
        agreement: options.agreement,
        gaussians: lifted.gaussians.len(),
        unseen_gaussians: lifted.unseen,
        views_without_picture,
        views: lifted.views,
        refit_rms: lifted.refit_rms,
        cpu_seconds,
        provider: None,
    })
}

/// Views with their pictures; warns of pictures that belong to none.
fn find_pictures(
    capture: &Capture,
    folder: &Path,
    context: &Context,
) -> anyhow::Result<Vec<(usize, PathBuf)>> {
    let entries = std::fs::read_dir(folder).map_err(|error| {
        StageError::bad_input(format!(
            "images: cannot read the folder ({error}): {}",
            folder.display()
        ))
    })?;
    let is_picture = |path: &PathBuf| {
        let suffix = path.extension().and_then(|s| s.to_str()).unwrap_or_default();
        path.is_file() && SUFFIXES.contains(&suffix.to_ascii_lowercase().as_str())
    };
    let mut left: BTreeSet<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_picture).collect();
    let mut found = Vec::new();
    for (view, stem) in view_stems(capture).iter().enumerate() {
        let of_view = |path: &&PathBuf| path.file_stem().is_some_and(|s| s == stem.as_str());
        let paths: Vec<PathBuf> = left.iter().filter(of_view).cloned().collect();
        if let [first, second, ..] = &paths[..] {
            let (first, second) = (first.display(), second.display());
            let text = format!("two pictures of one view: {first} and {second}");
            return Err(StageError::bad_input(text).into());
        }
        for path in paths {
            left.remove(&path);
            found.push((view, path));
        }
    }
    if found.is_empty() {
        let text = format!("no picture is named after a view of the capture: {}", folder.display());
        let example = view_stems(capture).into_iter().next().unwrap_or_default();
        return Err(StageError::bad_input(text)
            .help(format!("pictures are named like {example}.png"))
            .into());
    }
    if let Some(first) = left.first() {
        let n = left.len();
        context.warn(format!("{n} pictures belong to no view, such as {}", first.display()));
    }
    Ok(found)
}

fn load_view(
    capture: &Capture,
    document: &Path,
    index: usize,
    path: &Path,
) -> anyhow::Result<RelitView> {
    let view = &capture.views[index];
    let image = read_image(path)?;
    let camera = pinhole_of(capture, index).or_bad_input()?;
    let (aspect, own) = (image.width * camera.height, image.height * camera.width);
    // A pixel of rounding in either side.
    if aspect.abs_diff(own) > camera.width + camera.height + image.width + image.height {
        let (w, h) = (image.width, image.height);
        let text = format!(
            "the picture has {w} x {h} pixels, its view {} x {}: {}",
            camera.width,
            camera.height,
            path.display()
        );
        return Err(StageError::bad_input(text)
            .help("relit views keep the shape of the photo")
            .into());
    }
    let pixels = image.to_f32();
    let rgb = pixels.data.chunks_exact(pixels.channels).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut mask = match &view.mask {
        Some(mask) => Some(read_mask(&resolve(document, mask))?.to_f32()),
        None => None,
    };
    if mask.as_ref().is_some_and(|m| (m.width, m.height) != (image.width, image.height)) {
        mask = mask.map(|m| nearest(&m, image.width, image.height));
    }
    if pixels.channels == 4 {
        let alpha = pixels.data.chunks_exact(4).map(|p| p[3]).collect();
        let alpha = ImageF32::from_data(image.width, image.height, 1, alpha);
        mask = Some(match mask {
            None => alpha,
            Some(mut mask) => {
                mask.data.iter_mut().zip(&alpha.data).for_each(|(m, a)| *m *= a);
                mask
            }
        });
    }
    Ok(RelitView {
        name: view.name.clone(),
        camera: camera.resized(image.width, image.height),
        camera_from_world: view.camera_from_world,
        picture: ImageF32::from_data(image.width, image.height, 3, rgb),
        mask,
    })
}

fn nearest(image: &ImageF32, width: usize, height: usize) -> ImageF32 {
    let at = |i: usize| {
        let (x, y) = (i % width * image.width / width, i / width * image.height / height);
        image.pixel(x, y)[0]
    };
    ImageF32::from_data(width, height, 1, (0..width * height).map(at).collect())
}

impl fmt::Display for LiftReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.views.len();
        writeln!(f, "{n} relit views on {} Gaussians: {}", self.gaussians, self.output.display())?;
        writeln!(f, "{:<24} {:>22} {:>12} {:>8}", "view", "gain r g b", "off, stops", "weight")?;
        for v in &self.views {
            let [r, g, b] = v.gain_rgb;
            let gain = format!("{r:.2} {g:.2} {b:.2}");
            let (off, weight) = (v.disagreement_stops, v.weight);
            writeln!(f, "{:<24} {gain:>22} {off:>12.2} {weight:>8.2}", v.name)?;
        }
        if let Some([before, after]) = self.refit_rms {
            writeln!(f, "refit: error {before:.4} to {after:.4} (rms, sRGB-encoded)")?;
        }
        Ok(())
    }
}
