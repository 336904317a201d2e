//! Photos with their cameras, small enough for a page.

use std::path::Path;

use crate::html::ViewerPhoto;
use motes_formats::images::{encode_jpeg, read_image};
use motes_math::resample::{Filter, resize};
use motes_scene::{Capture, ImageU8, Split, View};
use motes_stage::Context;

use super::options::PageOptions;

/// Visually lossless at the sizes of a page.
const JPEG_QUALITY: u8 = 92;

/// Held-out views evenly spread over `capture`, training views when none is held out.
///
/// # Errors
/// When a photo cannot be read.
pub(super) fn photos(
    capture: &Capture,
    folder: &Path,
    options: &PageOptions,
    context: &Context,
) -> anyhow::Result<Vec<ViewerPhoto>> {
    let mut views = capture.views_of(Split::Test);
    if views.is_empty() {
        views = capture.views_of(Split::Train);
    }
    let before = views.len();
    views.retain(|v| capture.cameras[capture.views[*v].camera].as_pinhole().is_some());
    if views.len() < before {
        context.warn(format!(
            "{} photos have lens distortion, which the page does not draw: import them again with import-colmap",
            before - views.len()
        ));
    }
    let n = views.len().min(options.photos);
    let side = options.photo_size;
    (0..n).map(|i| photo(capture, views[i * views.len() / n], folder, side)).collect()
}

/// The photo of a view, its longer side at most `longer_px` pixels.
///
/// # Errors
/// When it cannot be read, or its camera has lens distortion.
pub fn photo(
    capture: &Capture,
    view: usize,
    folder: &Path,
    longer_px: u32,
) -> anyhow::Result<ViewerPhoto> {
    let View { name, camera, camera_from_world, image, .. } = &capture.views[view];
    let image = rgb(&read_image(&folder.join(image))?);
    let (width, height) = (image.width, image.height);
    let factor = (f64::from(longer_px) / width.max(height) as f64).min(1.0);
    let side = |length: usize| ((length as f64 * factor).round() as usize).max(1);
    let size = (side(width), side(height));
    let image = if size == (width, height) { image } else { resized(&image, size) };
    let Some(pinhole) = capture.cameras[*camera].as_pinhole() else {
        anyhow::bail!("the view {name} has lens distortion");
    };
    Ok(ViewerPhoto {
        name: name.clone(),
        camera: pinhole.resized(size.0, size.1),
        size: [pinhole.width, pinhole.height],
        camera_from_world: *camera_from_world,
        jpeg: encode_jpeg(&image, JPEG_QUALITY),
    })
}

/// Without its alpha channel, if it has one.
fn rgb(image: &ImageU8) -> ImageU8 {
    let data = image.data.chunks_exact(image.channels).flat_map(|p| [p[0], p[1], p[2]]).collect();
    ImageU8::from_data(image.width, image.height, 3, data)
}

fn resized(image: &ImageU8, (width, height): (usize, usize)) -> ImageU8 {
    let source = image.to_f32();
    let size = (image.width, image.height, 3);
    let data = resize(&source.data, size, (width, height), Filter::Box);
    motes_scene::ImageF32::from_data(width, height, 3, data).to_u8()
}
