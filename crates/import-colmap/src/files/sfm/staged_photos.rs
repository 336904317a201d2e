//! Photos as the solver shall see them: upright.
//!
//! COLMAP works on pixels as stored. Phones store photos lying on their side with an EXIF
//! orientation; solved as stored, the capture would lie on its side. Turned copies go to the
//! workspace, with their EXIF data (the focal length is in it) but without the orientation; the
//! other photos are linked.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use image::codecs::jpeg::JpegEncoder;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageEncoder, ImageReader};
use rayon::prelude::*;

use super::heif_photos;
use super::pycolmap::cannot_write;
use crate::error::{IngestError, Result};
use crate::files::locate_image::is_image;
use crate::progress::Progress;

/// JPEG quality of turned copies; they are only for finding features.
const QUALITY: u8 = 95;

/// The folder to solve.
pub(super) struct Staged {
    pub(super) folder: PathBuf,
    /// Names of the photos that were turned.
    pub(super) turned: BTreeSet<String>,
}

/// Makes the folder: the photos' own when no photo needs turning.
pub(super) fn stage(photos: &Path, workspace: &Path, progress: &dyn Progress) -> Result<Staged> {
    let mut names = Vec::new();
    list_all(photos, "", &mut names)?;
    heif_photos::refuse(photos, &names)?;
    names.retain(|name| is_image(name));
    names.sort();
    let orientations: Vec<Orientation> =
        names.par_iter().map(|name| orientation(&photos.join(name))).collect();
    let turned: BTreeSet<String> = names
        .iter()
        .zip(&orientations)
        .filter(|(_, orientation)| **orientation != Orientation::NoTransforms)
        .map(|(name, _)| name.clone())
        .collect();
    if turned.is_empty() {
        return Ok(Staged { folder: photos.to_path_buf(), turned });
    }
    let folder = workspace.join("upright");
    progress.begin("turning photos upright", names.len());
    names
        .par_iter()
        .zip(&orientations)
        .enumerate()
        .map(|(index, (name, orientation))| {
            if progress.interrupted() {
                return Err(IngestError::Interrupted);
            }
            let (from, to) = (photos.join(name), folder.join(name));
            let parent = to.parent().unwrap_or(&folder);
            std::fs::create_dir_all(parent).map_err(|e| cannot_write(parent, &e))?;
            if to.exists() {
                std::fs::remove_file(&to).map_err(|e| cannot_write(&to, &e))?;
            }
            if *orientation == Orientation::NoTransforms {
                link(&from, &to).map_err(|e| cannot_write(&to, &e))?;
            } else {
                turn(&from, &to, *orientation)?;
            }
            progress.advance_to(index + 1);
            Ok(())
        })
        .collect::<Result<()>>()?;
    Ok(Staged { folder, turned })
}

/// Image files below a folder, `/` between parts, hidden ones left out.
pub(super) fn list(root: &Path, below: &str, names: &mut Vec<String>) -> Result<()> {
    let first = names.len();
    list_all(root, below, names)?;
    let found = names.split_off(first);
    names.extend(found.into_iter().filter(|name| is_image(name)));
    Ok(())
}

/// Files below a folder, `/` between parts, hidden ones left out.
fn list_all(root: &Path, below: &str, names: &mut Vec<String>) -> Result<()> {
    let folder = root.join(below);
    let entries = std::fs::read_dir(&folder).map_err(|error| {
        let cause = format!("cannot read the folder of photos ({error}): {}", folder.display());
        IngestError::bad_input(cause, "give the folder that holds the photos")
    })?;
    for entry in entries.flatten() {
        let Ok(file) = entry.file_name().into_string() else { continue };
        if file.starts_with('.') {
            continue;
        }
        let name = if below.is_empty() { file } else { format!("{below}/{file}") };
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            list_all(root, &name, names)?;
        } else {
            names.push(name);
        }
    }
    Ok(())
}

/// EXIF orientation; a photo that cannot be read has none (the solver will name it).
fn orientation(path: &Path) -> Orientation {
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    let decoder = reader.ok().and_then(|reader| reader.into_decoder().ok());
    decoder.and_then(|mut d| d.orientation().ok()).unwrap_or(Orientation::NoTransforms)
}

fn turn(from: &Path, to: &Path, orientation: Orientation) -> Result<()> {
    let broken = |error: image::ImageError| {
        let cause = format!("cannot turn the photo upright ({error}): {}", from.display());
        IngestError::bad_input(cause, "open it in an image viewer and export it again")
    };
    let reader = ImageReader::open(from).and_then(ImageReader::with_guessed_format);
    let reader = reader.map_err(|error| broken(error.into()))?;
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let exif = decoder.exif_metadata().ok().flatten();
    let mut image = DynamicImage::from_decoder(decoder).map_err(broken)?;
    image.apply_orientation(orientation);
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
    if let Some(mut exif) = exif {
        // `None` says that there was no orientation entry, which is as good.
        let _ = Orientation::remove_from_exif_chunk(&mut exif);
        // Without EXIF only the focal length prior is lost, and the report says so.
        let _ = encoder.set_exif_metadata(exif);
    }
    let rgb = image.to_rgb8();
    let (width, height) = rgb.dimensions();
    encoder.write_image(&rgb, width, height, image::ExtendedColorType::Rgb8).map_err(broken)?;
    std::fs::write(to, bytes).map_err(|error| cannot_write(to, &error))
}

fn link(from: &Path, to: &Path) -> std::io::Result<()> {
    #[cfg(unix)]
    if let Ok(from) = from.canonicalize() {
        return std::os::unix::fs::symlink(from, to);
    }
    std::fs::copy(from, to).map(|_| ())
}
