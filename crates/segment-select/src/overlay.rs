//! Pictures of a selection over the photos.

use motes_raster::render_scalars;
use motes_scene::{ImageF32, ImageU8, Selection};

use crate::error::SelectError;
use crate::source::SelectSource;

/// What the selection is tinted with, sRGB-encoded: no natural color.
const TINT: [f32; 3] = [1.0, 0.1, 0.6];
/// Strength of the tint inside.
const INSIDE: f32 = 0.45;

/// The coverage of a selection, `[h, w, 1]`, at a camera and pose: the share of each pixel that its
/// Gaussians make up, where others hide them as they do in the picture.
pub fn selection_mask(
    gaussians: &motes_scene::Gaussians,
    selection: &Selection,
    camera: &motes_scene::Pinhole,
    camera_from_world: &motes_scene::Pose,
    options: &motes_raster::RenderOptions,
) -> ImageF32 {
    let belongs: Vec<f32> =
        (0..selection.len()).map(|i| f32::from(u8::from(selection.contains(i)))).collect();
    let rgb = render_scalars(gaussians, &[&belongs], camera, camera_from_world, options);
    let data = rgb.data.iter().step_by(3).copied().collect();
    ImageF32::from_data(rgb.width, rgb.height, 1, data)
}

/// A view's photo (or rendering, where there is none) at the working size, the selection tinted and
/// outlined.
///
/// # Errors
/// When the photo cannot be read or the camera has distortion.
pub fn overlay(
    source: &SelectSource<'_>,
    view: usize,
    selection: &Selection,
) -> Result<ImageU8, SelectError> {
    let (camera, pose, mut picture) = source.picture(view)?;
    let mask = selection_mask(source.gaussians, selection, &camera, &pose, &source.options);
    let (w, h) = (camera.width, camera.height);
    let inside = |p: usize| mask.data[p] > 0.5;
    for p in 0..w * h {
        let (x, y) = (p % w, p / w);
        let edge = inside(p)
            && [
                (x > 0).then(|| p - 1),
                (x + 1 < w).then_some(p + 1),
                (y > 0).then(|| p - w),
                (y + 1 < h).then_some(p + w),
            ]
            .into_iter()
            .flatten()
            .any(|q| !inside(q));
        let strength = if edge { 1.0 } else { INSIDE * mask.data[p].clamp(0.0, 1.0) };
        for (value, tint) in picture.data[3 * p..3 * p + 3].iter_mut().zip(TINT) {
            *value += strength * (tint - *value);
        }
    }
    Ok(picture.to_u8())
}
