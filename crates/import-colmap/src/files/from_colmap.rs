//! COLMAP models as a source.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use motes_formats::colmap::{ColmapModel, read_model};

use crate::error::{IngestError, Result};
use crate::files::locate_image::{ImageFinder, is_image};
use crate::gathered::{Gathered, Lens, Photo, Point};

/// Reads the models, keeps the one with the most images, and finds its photos.
pub(crate) fn gather(models: &[PathBuf], images: &Path) -> Result<Gathered> {
    let (directory, model, mut notes) = largest(models)?;
    notes.extend(model.notes.iter().cloned());
    let mut finder = ImageFinder::new(images);
    let mut gathered = Gathered {
        photos_offered: count_images(images).max(model.images.len()),
        description: format!("COLMAP model {}", directory.display()),
        notes,
        ..Gathered::default()
    };
    let point_index: HashMap<u64, usize> =
        model.points.iter().enumerate().map(|(index, point)| (point.id, index)).collect();
    let mut photo_index = HashMap::new();
    let mut missing = Vec::new();
    for image in &model.images {
        let Some(path) = finder.find(&image.name) else {
            missing.push(image.name.as_str());
            continue;
        };
        photo_index.insert(image.id, gathered.photos.len());
        let observations = image
            .observations
            .iter()
            .filter_map(|(pixel, point)| Some((*pixel, *point_index.get(point)?)))
            .collect();
        gathered.photos.push(Photo {
            name: image.name.clone(),
            path,
            mask: None,
            lens: Lens::Camera(model.cameras[&image.camera_id].clone()),
            camera_from_world: image.camera_from_world,
            split: None,
            upright: false,
            observations,
        });
    }
    report_missing(&missing, model.images.len(), images, &mut gathered)?;
    gathered.points = points_of(&model, &photo_index);
    Ok(gathered)
}

/// The points of a model; tracks hold the indices that `photo_index` gives for image ids.
pub(crate) fn points_of(model: &ColmapModel, photo_index: &HashMap<u32, usize>) -> Vec<Point> {
    let point = |p: &motes_formats::colmap::ColmapPoint| {
        let mut track: Vec<usize> =
            p.track.iter().filter_map(|id| photo_index.get(id).copied()).collect();
        track.sort_unstable();
        track.dedup();
        Point { position: p.position, color: p.color, error: p.error, track }
    };
    model.points.iter().map(point).collect()
}

/// The model with the most images; then the most points; then the first.
pub(crate) fn largest(models: &[PathBuf]) -> Result<(PathBuf, ColmapModel, Vec<String>)> {
    let mut best: Option<(PathBuf, ColmapModel)> = None;
    let mut sizes = Vec::new();
    for directory in models {
        let model = read_model(directory)?;
        sizes.push(format!("{} ({} photos)", directory.display(), model.images.len()));
        let size = |m: &ColmapModel| (m.images.len(), m.points.len());
        if best.as_ref().is_none_or(|(_, other)| size(&model) > size(other)) {
            best = Some((directory.clone(), model));
        }
    }
    let Some((directory, model)) = best else {
        return Err(IngestError::bad_input(
            "there is no COLMAP model",
            "run structure from motion first",
        ));
    };
    if model.images.is_empty() {
        return Err(IngestError::bad_input(
            format!("the model has no images: {}", directory.display()),
            "run structure from motion again, or give the folder of another model with --model",
        ));
    }
    let mut notes = Vec::new();
    if sizes.len() > 1 {
        notes.push(format!(
            "there are {} models that do not join: {}; the largest, {}, was taken",
            sizes.len(),
            sizes.join(", "),
            directory.display()
        ));
    }
    Ok((directory, model, notes))
}

/// Says which photos of a source are not on disk; fails when none is.
pub(crate) fn report_missing(
    missing: &[&str],
    named: usize,
    folder: &Path,
    gathered: &mut Gathered,
) -> Result<()> {
    let first = missing.iter().take(5).copied().collect::<Vec<_>>().join(", ");
    if gathered.photos.is_empty() {
        return Err(IngestError::bad_input(
            format!(
                "none of the {named} photos that the model names is here ({first}): {}",
                folder.display()
            ),
            "give the folder of the photos with --images; names are relative to it",
        ));
    }
    if !missing.is_empty() {
        let more = if missing.len() > 5 { ", ..." } else { "" };
        gathered.warnings.push(format!(
            "{} of {named} photos are missing in {} and were left out: {first}{more}; give the right folder with --images",
            missing.len(),
            folder.display()
        ));
    }
    Ok(())
}

/// Number of image files in a folder and its subfolders (3 levels).
fn count_images(folder: &Path) -> usize {
    fn count(folder: &Path, depth: usize) -> usize {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries
            .map(|entry| match entry.file_type() {
                Ok(kind) if kind.is_dir() && depth > 0 => count(&entry.path(), depth - 1),
                Ok(_) => usize::from(entry.file_name().to_str().is_some_and(is_image)),
                Err(_) => 0,
            })
            .sum()
    }
    count(folder, 2)
}
