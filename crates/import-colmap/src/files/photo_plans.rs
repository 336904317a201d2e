//! Which photos become views, and what happens to each: sizes, masks, files that cannot be read.

use std::path::{Path, PathBuf};

use motes_formats::images::{image_dimensions, image_dimensions_upright};
use motes_scene::Split;

use crate::error::{IngestError, Result};
use crate::files::locate_image::find_mask;
use crate::files::photos_out::{Done, Outcome, broken_photo};
use crate::gathered::{Gathered, Photo};
use crate::options::ImportOptions;
use crate::plan::Plans;

/// The plan of every photo, and what is wrong with those that cannot be read, which lose their split.
pub(crate) fn plan_photos(
    gathered: &mut Gathered,
    splits: &mut [Option<Split>],
    plans: &mut Plans,
) -> Result<(Vec<usize>, Vec<String>)> {
    let mut plan_of = Vec::with_capacity(gathered.photos.len());
    let mut broken = Vec::new();
    for (photo, split) in gathered.photos.iter_mut().zip(splits) {
        let plan = match dimensions(&photo.path) {
            Ok(sizes) => plan_for(photo, sizes, plans, &mut gathered.warnings)?,
            Err(error) => {
                broken.push(broken_photo(error.into())?);
                *split = None;
                usize::MAX
            }
        };
        plan_of.push(plan);
    }
    Ok((plan_of, broken))
}

/// The plan of a photo; decides whether its pixels must be turned upright.
///
/// COLMAP ignores EXIF orientation, so poses belong to the pixels as stored. Only when those do
/// not fit the camera and the upright ones do, the poses were made from upright copies.
fn plan_for(
    photo: &mut Photo,
    [stored, upright]: [(usize, usize); 2],
    plans: &mut Plans,
    warnings: &mut Vec<String>,
) -> Result<usize> {
    let (width, height) = if photo.upright { upright } else { stored };
    let cause = match plans.plan_for(&photo.lens.camera(width, height), width, height) {
        Ok(plan) => return Ok(plan),
        Err(cause) => cause,
    };
    if !photo.upright && upright != stored {
        let camera = photo.lens.camera(upright.0, upright.1);
        if let Ok(plan) = plans.plan_for(&camera, upright.0, upright.1) {
            photo.upright = true;
            warnings.push(format!(
                "{} was turned by its EXIF orientation: only so it fits its camera",
                photo.name
            ));
            return Ok(plan);
        }
    }
    Err(IngestError::bad_input(
        format!("{cause}: {}", photo.path.display()),
        "give the photos that the poses were made from (any size, but not cropped or turned)",
    ))
}

/// Size of a photo as stored, and upright.
fn dimensions(path: &Path) -> motes_formats::Result<[(usize, usize); 2]> {
    Ok([image_dimensions(path)?, image_dimensions_upright(path)?])
}

/// Checks that there is a photo to train on.
pub(crate) fn some_train(splits: &[Option<Split>], broken: &[String]) -> Result<()> {
    if splits.contains(&Some(Split::Train)) {
        return Ok(());
    }
    match broken.first() {
        None => Err(IngestError::bad_input(
            "no photo is left to train on",
            "give more photos, or hold out fewer of them",
        )),
        Some(first) => Err(IngestError::bad_input(
            format!("no photo that can be read is left to train on: {first}"),
            "copy the photos again: files that end early were not copied to their end",
        )),
    }
}

/// A sentence about photos that cannot be read.
pub(crate) fn left_out(broken: &[String]) -> Option<String> {
    let first = broken.iter().take(3).cloned().collect::<Vec<_>>().join("; ");
    let more = if broken.len() > 3 { "; ..." } else { "" };
    let count = broken.len();
    (count > 0).then(|| {
        format!("{count} photos cannot be read and were left out: {first}{more}; copy them again")
    })
}

/// What is left when photos that could not be processed lose their split and their names.
pub(crate) fn without_broken(
    kept: Vec<usize>,
    names: Vec<String>,
    outcomes: Vec<Outcome>,
    crops_of: impl Fn(usize) -> usize,
    splits: &mut [Option<Split>],
    broken: &mut Vec<String>,
) -> (Vec<usize>, Vec<String>, Vec<Done>) {
    let mut left = (Vec::new(), Vec::new(), Vec::new());
    let mut names = names.into_iter();
    for (i, outcome) in kept.into_iter().zip(outcomes) {
        let own: Vec<String> = names.by_ref().take(crops_of(i)).collect();
        match outcome {
            Outcome::Done(done) => {
                left.0.push(i);
                left.1.extend(own);
                left.2.push(done);
            }
            Outcome::LeftOut(why) => {
                broken.push(why);
                splits[i] = None;
            }
        }
    }
    left
}

/// The mask file of every photo.
pub(crate) fn masks_of(
    gathered: &Gathered,
    options: &ImportOptions,
) -> Result<Vec<Option<PathBuf>>> {
    let Some(folder) = &options.masks else {
        return Ok(gathered.photos.iter().map(|photo| photo.mask.clone()).collect());
    };
    let masks: Vec<_> =
        gathered.photos.iter().map(|photo| find_mask(folder, &photo.name)).collect();
    if masks.iter().all(Option::is_none) {
        return Err(IngestError::bad_input(
            format!("no mask of any photo is here: {}", folder.display()),
            "the mask of sub/IMG_1.jpg is sub/IMG_1.png, sub/IMG_1.jpg.png or sub/IMG_1.mask.png",
        ));
    }
    Ok(masks)
}

/// Refuses an output whose `images` or `masks` folder holds a source file: writing there would
/// destroy it.
pub(crate) fn protect_sources(
    gathered: &Gathered,
    masks: &[Option<PathBuf>],
    output: &Path,
) -> Result<()> {
    let targets: Vec<PathBuf> = ["images", "masks"]
        .iter()
        .filter_map(|name| output.join(name).canonicalize().ok())
        .collect();
    let sources = gathered.photos.iter().map(|photo| &photo.path).chain(masks.iter().flatten());
    for source in sources.filter_map(|path| path.canonicalize().ok()) {
        if targets.iter().any(|target| source.starts_with(target)) {
            let cause =
                format!("the output would overwrite this photo or mask: {}", source.display());
            return Err(IngestError::usage(cause, "write the capture to another folder with -o"));
        }
    }
    Ok(())
}
