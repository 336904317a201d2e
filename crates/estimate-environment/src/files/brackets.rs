//! Exposure series of pictures.

use std::path::{Path, PathBuf};

use motes_formats::environment::read_environment;
use motes_formats::images::{exposure_stops, image_dimensions, read_image_upright};
use motes_math::resample::{Filter, resize};
use motes_math::srgb;
use motes_scene::ImageF32;
use motes_stage::{Context, StageError};

use super::arguments::{Args, Estimate};
use super::frame::{axes_of, up_of};
use super::frame::{axes_without_pose, capture, pose_of_view, turn};
use super::report::BracketReport;
use super::values::seconds;
use crate::brackets::{Exposed, MergeOptions, Merged, Response, merge};
use crate::fill::fill;
use crate::sphere::texel_solid_angle;

const ENDINGS: [&str; 10] =
    ["jpg", "jpeg", "png", "tif", "tiff", "webp", "bmp", "exr", "hdr", "ppm"];
/// Bytes that a pixel of a series of `n` takes: the pictures, what moved, the result.
const BYTES_PER_PIXEL: u64 = 20;
/// Value from which a single picture is clipped.
const CLIPPED: f32 = 0.985;

/// A linear picture with what is known about it.
pub(super) struct LinearPicture {
    pub(super) image: ImageF32,
    pub(super) clipped: Vec<bool>,
    pub(super) series: Option<BracketReport>,
}

/// A linear picture: a file, or a folder with a series.
pub(super) fn linear_picture(
    args: &Args,
    path: &Path,
    role: &str,
    context: &Context,
) -> anyhow::Result<LinearPicture> {
    context.input(role, path)?;
    if path.is_dir() {
        return merged(args, path, role, context);
    }
    let (image, is_linear) = picture(path)?;
    let mut image = image;
    let clipped = image.data.chunks_exact(3).map(|p| !is_linear && p.iter().any(|v| *v >= CLIPPED));
    let clipped = clipped.collect();
    if !is_linear {
        image.data.iter_mut().for_each(|v| *v = srgb::decode(*v));
    }
    Ok(LinearPicture { image, clipped, series: None })
}

/// RGB as stored, and whether that is linear.
fn picture(path: &Path) -> anyhow::Result<(ImageF32, bool)> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    if ending.is_some_and(|e| e == "exr" || e == "hdr") {
        let mut image = read_environment(path)?;
        image.data.iter_mut().for_each(|v| *v = if v.is_finite() { v.max(0.0) } else { 0.0 });
        return Ok((image, true));
    }
    let image = read_image_upright(path)?.to_f32();
    let rgb = image.data.chunks_exact(image.channels).flat_map(|p| [p[0], p[1], p[2]]).collect();
    Ok((ImageF32::from_data(image.width, image.height, 3, rgb), false))
}

fn pictures_of(folder: &Path, role: &str) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let entries = std::fs::read_dir(folder);
    let failed = |e| StageError::bad_input(format!("{role}: {e}: {}", folder.display()));
    for entry in entries.map_err(failed)? {
        let path = entry?.path();
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        if path.is_file() && ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Exposures of the pictures, log2: of `--exposure-times`, else of their metadata.
fn stops_of(args: &Args, files: &[PathBuf], folder: &Path) -> anyhow::Result<Vec<f64>> {
    if let Some(times) = &args.exposure_times {
        let times: Result<Vec<f64>, String> = times.split(',').map(seconds).collect();
        let times = times.map_err(|e| StageError::usage(format!("--exposure-times: {e}")))?;
        if times.len() != files.len() {
            let text = format!(
                "--exposure-times has {} times, the folder {} pictures: {}",
                times.len(),
                files.len(),
                folder.display()
            );
            return Err(StageError::usage(text)
                .help("give one time per picture, in the order of their names")
                .into());
        }
        return Ok(times.into_iter().map(f64::log2).collect());
    }
    let stops = |path: &PathBuf| {
        exposure_stops(path).ok_or_else(|| {
            let text = format!("the picture does not say how it was exposed: {}", path.display());
            StageError::bad_input(text).help("give --exposure-times, in the order of their names")
        })
    };
    Ok(files.iter().map(stops).collect::<Result<_, _>>()?)
}

fn merged(
    args: &Args,
    folder: &Path,
    role: &str,
    context: &Context,
) -> anyhow::Result<LinearPicture> {
    let files = pictures_of(folder, role)?;
    if files.is_empty() {
        let text = format!("{role}: no pictures: {}", folder.display());
        return Err(StageError::bad_input(text).into());
    }
    let stops = stops_of(args, &files, folder)?;
    let is_linear = |path: &PathBuf| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case("hdr"))
    };
    if let Some(first) = files.iter().find(|f| !is_linear(f)) {
        let (w, h) = image_dimensions(first)?;
        let bytes = (w * h * files.len()) as u64 * BYTES_PER_PIXEL;
        context.need_memory(bytes, "take smaller pictures")?;
    }
    let mut series = Vec::new();
    for (path, stops) in files.iter().zip(&stops) {
        let (mut image, linear) = picture(path)?;
        if linear != is_linear(&files[0]) {
            let text = format!("linear and encoded pictures in one series: {}", path.display());
            return Err(StageError::bad_input(text).help("keep one kind in the folder").into());
        }
        image.data.iter_mut().for_each(|v| *v = v.clamp(0.0, 1.0));
        series.push(Exposed { image, stops: *stops });
    }
    context.stop_if_dry_run()?;
    let named = |e: crate::brackets::BracketError| {
        StageError::bad_input(format!("{e}: {}", folder.display()))
            .help("a series has pictures of one place and several exposures")
    };
    let response = match is_linear(&files[0]) {
        true => Response::Linear,
        false => Response::find(&series).map_err(named)?,
    };
    let options = MergeOptions { deghost: !args.keep_ghosts };
    let Merged { radiance, clipped, ghosts, reference } =
        merge(&series, &response, &options).map_err(named)?;
    let name = |path: &PathBuf| {
        path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let report = BracketReport {
        pictures: files.iter().map(name).zip(stops).collect(),
        reference: name(&files[reference]),
        response: if response == Response::Linear { "linear" } else { "found" },
        ghosts,
    };
    Ok(LinearPicture { image: radiance, clipped, series: Some(report) })
}

/// The light of `--brackets`: a series of panoramas.
pub(super) fn of_brackets(
    args: &Args,
    folder: &Path,
    context: &Context,
) -> anyhow::Result<Estimate> {
    let capture = capture(args, context)?;
    let pose = pose_of_view(args, capture.as_ref())?;
    let picture = linear_picture(args, folder, "brackets", context)?;
    let (w, h) = (picture.image.width, picture.image.height);
    if w != 2 * h {
        let text =
            format!("a panorama is twice as wide as high, not {w}x{h}: {}", folder.display());
        return Err(StageError::bad_input(text)
            .help("for pictures of a mirror ball take --mirror-ball")
            .into());
    }
    context.stop_if_dry_run()?;
    let rows = args.rows.min(h);
    let small = resize(&picture.image.data, (w, h, 3), (2 * rows, rows), Filter::Box);
    let small = ImageF32::from_data(2 * rows, rows, 3, small);
    let weights = vec![1.0; 2 * rows * rows];
    let axes = match &pose {
        Some(_) => axes_of(args, up_of(args, capture.as_ref(), None)),
        None => axes_without_pose(args.convention),
    };
    let (map, seen) = turn(&small, &weights, pose.as_ref(), &axes);
    let omega = |i: usize| texel_solid_angle(i / w, w, h) / (4.0 * std::f64::consts::PI);
    let clipped = (0..w * h).filter(|i| picture.clipped[*i]).map(omega).sum();
    Ok(Estimate {
        coverage: 1.0,
        clipped_share: clipped,
        brackets: picture.series,
        ..Estimate::new("brackets", fill(&map, &seen), axes)
    })
}
