//! Photos of a capture as the fit wants them.

use std::io;
use std::path::Path;

use crate::TrainingImage;
use motes_formats::capture::resolve;
use motes_formats::images::{read_image, read_mask};
use motes_formats::{FormatError, Result};
use motes_scene::{Capture, ImageU8};
use rayon::prelude::*;
use sha2::{Digest, Sha256};

/// Reads the photos (and masks) of `views` of a capture, in order.
///
/// # Errors
/// When a file cannot be read, its size is not that of its camera, or a camera is distorted.
pub fn load_training_images(
    document: &Path,
    capture: &Capture,
    views: &[usize],
) -> Result<Vec<TrainingImage>> {
    views.par_iter().map(|&view| load(document, capture, view)).collect()
}

fn load(document: &Path, capture: &Capture, view: usize) -> Result<TrainingImage> {
    let record = &capture.views[view];
    let camera = capture.cameras[record.camera].as_pinhole().ok_or_else(|| {
        let cause = format!("view \"{}\" has a distorted camera", record.name);
        FormatError::not_supported(document, "cameras", cause)
            .with_remedy("import the photos with import-colmap, which undistorts them")
    })?;
    let check = |path: &Path, image: ImageU8| {
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
    let image = check(&path, read_image(&path)?)?;
    let mask = match &record.mask {
        Some(mask) => {
            let path = resolve(document, mask);
            Some(check(&path, read_mask(&path)?)?)
        }
        None => None,
    };
    Ok(TrainingImage {
        name: record.name.clone(),
        camera,
        camera_from_world: record.camera_from_world,
        image: image.into(),
        mask,
        exposure_gain: capture.exposure_gain(view),
    })
}

/// SHA-256 of a file, hexadecimal: binds a checkpoint to its capture.
///
/// # Errors
/// When the file cannot be read.
pub(crate) fn sha256_of(path: &Path) -> Result<String> {
    let mut hasher = Sha256::new();
    let mut file = std::fs::File::open(path).map_err(|e| FormatError::io(path, e))?;
    io::copy(&mut file, &mut hasher).map_err(|e| FormatError::io(path, e))?;
    Ok(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}
