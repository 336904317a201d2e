//! The photos that `decompose` reads.

use std::path::Path;

use crate::{Photo, Radiance, choose_photos};
use glam::DVec3;
use motes_formats::capture::{read_capture, resolve};
use motes_formats::images::{read_image, read_mask};
use motes_formats::{FormatError, Result};
use motes_math::srgb;
use motes_scene::{Capture, Gaussians, ImageU8, Pinhole, Pose, Split, view_among};
use rayon::prelude::*;

/// A channel from here on is clipped.
const CLIPPED: u8 = 254;

/// Photos of one split of a capture, brought to the exposure of the model; `light` names their light.
///
/// # Errors
/// When a file cannot be read, its size is not that of its camera, or a camera is distorted.
pub(super) fn load_photos(
    document: &Path,
    capture: &Capture,
    views: &[usize],
    light: usize,
) -> Result<Vec<Photo>> {
    views.par_iter().map(|&view| load(document, capture, view, light)).collect()
}

/// The held-out views that are looked at: at most `most`, evenly over their order; 0 for all.
pub(super) fn held_out_views(capture: &Capture, most: usize) -> Vec<usize> {
    let all = capture.views_of(Split::Test);
    if most == 0 || all.len() <= most {
        return all;
    }
    (0..most).map(|k| all[(2 * k + 1) * all.len() / (2 * most)]).collect()
}

/// The training views that are looked at: at most `most`, chosen by what they show of `gaussians`, and those that are `named`.
pub(super) fn training_views(
    document: &Path,
    capture: &Capture,
    gaussians: &Gaussians,
    most: usize,
    named: &[&str],
) -> Result<Vec<usize>> {
    let views = capture.views_of(Split::Train);
    let cameras: Vec<(Pinhole, Pose)> = views
        .iter()
        .map(|&v| Ok((pinhole(document, capture, v)?, capture.views[v].camera_from_world)))
        .collect::<Result<_>>()?;
    let names = || views.iter().map(|&v| capture.views[v].name.as_str());
    let always: Vec<usize> = named.iter().filter_map(|name| view_among(names(), name)).collect();
    let chosen = choose_photos(&cameras, &gaussians.means, most, &always);
    Ok(chosen.into_iter().map(|k| views[k]).collect())
}

fn pinhole(document: &Path, capture: &Capture, view: usize) -> Result<Pinhole> {
    let record = &capture.views[view];
    capture.cameras[record.camera].as_pinhole().ok_or_else(|| {
        let cause = format!("view \"{}\" has a distorted camera", record.name);
        FormatError::not_supported(document, "cameras", cause)
            .with_remedy("import the photos with import-colmap, which undistorts them")
    })
}

fn load(document: &Path, capture: &Capture, view: usize, light: usize) -> Result<Photo> {
    let record = &capture.views[view];
    let camera = pinhole(document, capture, view)?;
    let read = |path: &Path, image: Result<ImageU8>| {
        let image = image?;
        if (image.width, image.height) == (camera.width, camera.height) {
            return Ok(image);
        }
        let (w, h) = (image.width, image.height);
        let cause = format!(
            "the picture has {w}x{h} pixels and its camera {}x{}",
            camera.width, camera.height
        );
        Err(FormatError::invalid(path, "", cause).with_remedy("import the photos again"))
    };
    let path = resolve(document, &record.image);
    let image = read(&path, read_image(&path))?;
    let mask = match &record.mask {
        Some(mask) => {
            let path = resolve(document, mask);
            Some(read(&path, read_mask(&path))?)
        }
        None => None,
    };
    let gain = capture.exposure_gain(view).max(1e-3);
    let linear = std::array::from_fn(|v| srgb::decode(v as f32 / 255.0 / gain));
    // A fourth channel is alpha: what is transparent there tells nothing.
    let hidden = |(i, pixel): (usize, &[u8])| {
        let masked = mask.as_ref().is_some_and(|mask| mask.data[i] < 128);
        masked || pixel.get(3).is_some_and(|alpha| *alpha < 128)
    };
    let pixels = || image.data.chunks_exact(image.channels);
    let is_clipped = |pixel: &[u8]| pixel[..3].iter().any(|v| *v >= CLIPPED);
    let clipped: Vec<bool> =
        pixels().enumerate().map(|(i, p)| is_clipped(p) && !hidden((i, p))).collect();
    let is_usable = |(i, p): (usize, &[u8])| !hidden((i, p)) && !is_clipped(p);
    let usable = pixels().enumerate().map(is_usable).collect();
    let values = pixels().map(|p| [p[0], p[1], p[2]]).collect();
    Ok(Photo {
        gain: [1.0; 3],
        name: record.name.clone(),
        camera,
        camera_from_world: record.camera_from_world,
        radiance_linear: Radiance::of_bytes([camera.width, camera.height], values, linear),
        light,
        usable,
        clipped,
    })
}

/// Reads a capture whose world must be that of the first.
///
/// # Errors
/// When it cannot be read, or its origin differs.
pub(super) fn load_capture(path: &Path, origin: Option<DVec3>) -> anyhow::Result<Capture> {
    let capture = read_capture(path)?;
    if origin.is_some_and(|origin| {
        (origin - capture.world_origin).length() > 1e-9 * origin.length().max(1.0)
    }) {
        let cause = "its origin is not that of the first capture";
        return Err(FormatError::invalid(path, "world_origin", cause)
            .with_remedy("import both captures into one world, with one --origin")
            .into());
    }
    Ok(capture)
}
