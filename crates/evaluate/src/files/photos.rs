//! Pictures to compare: the photos of a capture and renders of other programs.

use std::path::{Path, PathBuf};

use motes_formats::capture::resolve;
use motes_formats::images::{read_image, read_mask};
use motes_formats::{FormatError, Result};
use motes_scene::{Capture, ImageU8};

use crate::score::Photo;

/// Mask values from here on count: half of the 8-bit range, so that edges softened by resampling
/// fall on one side.
const MASK_COUNTS_FROM: u8 = 128;

/// Reads the photo of a view and its mask.
///
/// Transparent pixels are put over `background` (sRGB-encoded, [0, 1]), as renders are.
///
/// # Errors
/// When a file cannot be read or its size differs from the camera's.
pub fn load_photo(
    document: &Path,
    capture: &Capture,
    view: usize,
    background: [f32; 3],
) -> Result<Photo> {
    let view = &capture.views[view];
    let camera = &capture.cameras[view.camera];
    let size = (camera.width, camera.height);
    let path = resolve(document, &view.image);
    let image = read_image(&path)?;
    check_size(&path, &image, size)?;
    let counted = match &view.mask {
        None => None,
        Some(mask) => {
            let path = resolve(document, mask);
            let mask = read_mask(&path)?;
            check_size(&path, &mask, size)?;
            Some(mask.data.iter().map(|&v| v >= MASK_COUNTS_FROM).collect())
        }
    };
    Ok(Photo { rgb: over_background(image, background), counted })
}

/// Reads the picture that another program rendered for a view: `folder/<stem>.png`, else the
/// view's own name, else other common suffixes.
///
/// # Errors
/// When there is none, it cannot be read, or its size differs from the camera's.
pub fn load_render(
    folder: &Path,
    view_name: &str,
    stem: &str,
    size: (usize, usize),
    background: [f32; 3],
) -> Result<ImageU8> {
    let mut candidates = vec![folder.join(format!("{stem}.png")), folder.join(view_name)];
    candidates
        .extend(["jpg", "jpeg", "webp", "tif", "tiff"].map(|s| folder.join(format!("{stem}.{s}"))));
    let path: PathBuf =
        candidates.iter().find(|path| path.is_file()).cloned().ok_or_else(|| {
            FormatError::invalid(&candidates[0], "", format!("no picture of view \"{view_name}\""))
                .with_remedy("name the pictures after the views, for example with the suffix .png")
        })?;
    let image = read_image(&path)?;
    check_size(&path, &image, size)?;
    Ok(over_background(image, background))
}

fn check_size(path: &Path, image: &ImageU8, (width, height): (usize, usize)) -> Result<()> {
    if (image.width, image.height) == (width, height) {
        return Ok(());
    }
    let cause = format!(
        "the picture has {}x{} pixels and the camera of its view {width}x{height}",
        image.width, image.height
    );
    Err(FormatError::invalid(path, "", cause).with_remedy("import the photos again"))
}

/// Drops the fourth channel by compositing, 3 channels.
fn over_background(image: ImageU8, background: [f32; 3]) -> ImageU8 {
    if image.channels != 4 {
        return image;
    }
    let data = image.data.chunks_exact(4).flat_map(|pixel| {
        let alpha = f32::from(pixel[3]) / 255.0;
        let mix = |c: usize| f32::from(pixel[c]) * alpha + background[c] * 255.0 * (1.0 - alpha);
        [0, 1, 2].map(|c| mix(c).round() as u8)
    });
    ImageU8::from_data(image.width, image.height, 3, data.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transparency_goes_over_the_background() {
        let image = ImageU8::from_data(2, 1, 4, vec![100, 0, 0, 255, 100, 0, 0, 51]);
        let over = over_background(image, [1.0, 1.0, 0.0]);
        assert_eq!(over.data, [100, 0, 0, 224, 204, 0]);
    }
}
