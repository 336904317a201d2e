//! `transforms.json` files as a source.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use motes_formats::FormatError;
use motes_formats::ply::read_points;
use motes_formats::transforms::{Transforms, TransformsFrame, read_transforms};
use motes_scene::Split;

use crate::error::{IngestError, Result};
use crate::files::from_colmap::{largest, points_of, report_missing};
use crate::files::locate_image::ImageFinder;
use crate::gathered::{Gathered, Lens, Photo, Point};

/// Cameras of `transforms.json` and of a model beside it agree when their centers are this close,
/// relative to the extent of the cameras.
const SAME_FRAME: f64 = 1e-3;

/// Reads the files and finds photos, masks and start points.
pub(crate) fn gather(
    train: &Path,
    test: Option<&Path>,
    val: Option<&Path>,
    models: &[PathBuf],
) -> Result<Gathered> {
    let folder = train.parent().unwrap_or(Path::new("."));
    let main = read_transforms(train)?;
    let mut gathered =
        Gathered { description: format!("transforms {}", train.display()), ..Gathered::default() };
    let own_split = train.ends_with("transforms_train.json");
    let (held_out, unused) = if test.is_some() { (test, val) } else { (val, None) };
    if let Some(unused) = unused {
        gathered
            .notes
            .push(format!("{} was not used: the test file is held out", unused.display()));
    }
    let other = held_out.map(read_transforms).transpose()?;
    let mut frames: Vec<(&TransformsFrame, Option<Split>)> = Vec::new();
    let listed = listed_splits(&main, &mut gathered.notes);
    for frame in &main.frames {
        match &listed {
            Some(listed) => match listed.get(frame.file_path.as_str()) {
                Some(&split) => frames.push((frame, Some(split))),
                None => gathered
                    .notes
                    .push(format!("{} is in no list and was left out", frame.file_path)),
            },
            None => frames.push((frame, (own_split && other.is_some()).then_some(Split::Train))),
        }
    }
    for frame in other.iter().flat_map(|other| &other.frames) {
        if frames.iter().any(|(first, _)| first.file_path == frame.file_path) {
            let (file, cause) = (held_out.unwrap_or(train), "this photo is also a training photo");
            let place = format!("frame {}", frame.file_path);
            return Err(FormatError::invalid(file, place, cause).into());
        }
        frames.push((frame, Some(Split::Test)));
    }
    gathered.photos_offered = frames.len();
    if main.applied_transform.is_some() {
        gathered.notes.push(
            "the file says that a tool re-oriented the world (applied_transform); poses were taken as they are".into(),
        );
    }
    gather_photos(folder, &frames, &mut gathered)?;
    gathered.points = match &main.ply_file_path {
        Some(ply) => points_from_ply(&folder.join(ply), &mut gathered)?,
        None => points_from_models(models, &frames, &mut gathered)?,
    };
    Ok(gathered)
}

/// Splits from the file's own name lists; validation photos are held out when there is no test
/// list and left out otherwise.
fn listed_splits<'a>(
    main: &'a Transforms,
    notes: &mut Vec<String>,
) -> Option<HashMap<&'a str, Split>> {
    let train = main.train_filenames.as_ref()?;
    let held_out = main.test_filenames.as_ref().filter(|list| !list.is_empty());
    if held_out.is_some() && main.val_filenames.as_ref().is_some_and(|list| !list.is_empty()) {
        notes.push("val_filenames were not used: test_filenames are held out".into());
    }
    let held_out = held_out.or(main.val_filenames.as_ref());
    let train = train.iter().map(|name| (name.as_str(), Split::Train));
    let test = held_out.into_iter().flatten().map(|name| (name.as_str(), Split::Test));
    Some(train.chain(test).collect())
}

fn gather_photos(
    folder: &Path,
    frames: &[(&TransformsFrame, Option<Split>)],
    gathered: &mut Gathered,
) -> Result<()> {
    let mut finder = ImageFinder::new(folder);
    let mut missing = Vec::new();
    for (frame, split) in frames {
        let Some(path) = finder.find(&frame.file_path) else {
            missing.push(frame.file_path.as_str());
            continue;
        };
        let mask = frame.mask_path.as_ref().map(|mask| folder.join(mask));
        if let Some(mask) = mask.as_ref().filter(|mask| !mask.is_file()) {
            return Err(IngestError::bad_input(
                format!("the mask of {} is missing: {}", frame.file_path, mask.display()),
                "put it there or remove mask_path from the frame",
            ));
        }
        gathered.photos.push(Photo {
            name: frame.file_path.clone(),
            path,
            mask,
            lens: Lens::Intrinsics(frame.intrinsics.clone()),
            camera_from_world: frame.camera_from_world,
            split: *split,
            upright: false,
            observations: Vec::new(),
        });
    }
    report_missing(&missing, frames.len(), folder, gathered)?;
    shorten_names(&mut gathered.photos);
    gathered.photos.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(())
}

/// Names without their folders, when they stay unique.
fn shorten_names(photos: &mut [Photo]) {
    let short = |photo: &Photo| photo.name.rsplit('/').next().unwrap_or(&photo.name).to_string();
    let names: std::collections::HashSet<String> = photos.iter().map(short).collect();
    if names.len() == photos.len() {
        for photo in photos {
            photo.name = short(photo);
        }
    }
}

fn points_from_ply(path: &Path, gathered: &mut Gathered) -> Result<Vec<Point>> {
    if !path.is_file() {
        gathered
            .warnings
            .push(format!("the start points that the file names are missing: {}", path.display()));
        return Ok(Vec::new());
    }
    let points = read_points(path)?;
    let point = |(position, color): (&[f32; 3], &[u8; 3])| Point {
        position: glam::Vec3::from_array(*position).as_dvec3(),
        color: *color,
        error: None,
        track: Vec::new(),
    };
    Ok(points.positions.iter().zip(&points.colors).map(point).collect())
}

/// Start points of a COLMAP model beside the file, when its cameras say that it lives in the same
/// world.
fn points_from_models(
    models: &[PathBuf],
    frames: &[(&TransformsFrame, Option<Split>)],
    gathered: &mut Gathered,
) -> Result<Vec<Point>> {
    if models.is_empty() {
        return Ok(Vec::new());
    }
    let (directory, model, notes) = largest(models)?;
    gathered.notes.extend(notes);
    let file = |name: &str| name.rsplit('/').next().unwrap_or(name).to_string();
    let mut frame_of: HashMap<String, Option<&TransformsFrame>> = HashMap::new();
    for (frame, _) in frames {
        // A file name that two frames share identifies neither.
        frame_of.entry(file(&frame.file_path)).and_modify(|f| *f = None).or_insert(Some(frame));
    }
    let pairs: Vec<_> = model
        .images
        .iter()
        .filter_map(|image| Some((image, (*frame_of.get(&file(&image.name))?)?)))
        .collect();
    let centers: Vec<_> =
        pairs.iter().map(|(_, f)| f.camera_from_world.center_in_world()).collect();
    let extent = centers.iter().map(|c| c.distance(centers[0])).fold(0.0, f64::max);
    let apart = pairs
        .iter()
        .zip(&centers)
        .map(|((image, _), center)| image.camera_from_world.center_in_world().distance(*center))
        .fold(0.0, f64::max);
    let same_world = apart <= SAME_FRAME * extent.max(1e-9);
    if pairs.is_empty() || !same_world {
        gathered.warnings.push(format!(
            "the model in {} is in another world than the transforms; its points were not used",
            directory.display()
        ));
        return Ok(Vec::new());
    }
    gathered.description.push_str(&format!(", start points of {}", directory.display()));
    let index_of: HashMap<String, usize> =
        gathered.photos.iter().enumerate().map(|(i, photo)| (file(&photo.name), i)).collect();
    let photo_index =
        pairs.iter().filter_map(|(image, f)| Some((image.id, *index_of.get(&file(&f.file_path))?)));
    let photo_index: HashMap<u32, usize> = photo_index.collect();
    let point_index: HashMap<u64, usize> =
        model.points.iter().enumerate().map(|(index, point)| (point.id, index)).collect();
    for (image, _) in &pairs {
        if let Some(&photo) = photo_index.get(&image.id) {
            gathered.photos[photo].observations = image
                .observations
                .iter()
                .filter_map(|(pixel, point)| Some((*pixel, *point_index.get(point)?)))
                .collect();
        }
    }
    Ok(points_of(&model, &photo_index))
}
