//! COLMAP models: `cameras`, `images` and `points3D`, as text or binary.
//!
//! The layout is described in `docs/formats/colmap.md`. Files of COLMAP 3.x and 4.x are the same
//! to this reader: `rigs` and `frames` (3.12 and later) repeat what `images` says about the pose
//! of every photo and are not opened.

mod binary;
mod locate;
mod name;
mod text;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use motes_scene::{Camera, CameraModel, Pose};

use crate::error::{FormatError, Result};

pub use locate::{Layout, find_models, layout_of};
pub(crate) use name::relative_name;

/// Larger images are taken for damaged files.
pub const MAX_IMAGE_SIDE: u64 = 1 << 17;

/// One posed photo of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct ColmapImage {
    /// Number in the model's files.
    pub id: u32,
    /// Path below the image folder, `/` between parts; never absolute, never with `..`.
    pub name: String,
    /// Key into [`ColmapModel::cameras`].
    pub camera_id: u32,
    /// World to camera; camera axes x right, y down, z forward.
    pub camera_from_world: Pose,
    /// Keypoints that belong to a 3D point: pixel position (top-left pixel center at 0.5) and
    /// point id.
    pub observations: Vec<([f64; 2], u64)>,
}

/// One triangulated point.
#[derive(Clone, Debug, PartialEq)]
pub struct ColmapPoint {
    /// Number in the model's files.
    pub id: u64,
    /// World position.
    pub position: DVec3,
    /// 8-bit sRGB.
    pub color: [u8; 3],
    /// Mean reprojection error, pixels; `None` where the file has no number for it.
    pub error: Option<f64>,
    /// Ids of the images that see it; an image may appear twice.
    pub track: Vec<u32>,
}

/// Cameras, posed photos and points, in source units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColmapModel {
    /// Cameras by id.
    pub cameras: BTreeMap<u32, Camera>,
    /// Images sorted by name.
    pub images: Vec<ColmapImage>,
    /// Points in file order.
    pub points: Vec<ColmapPoint>,
    /// What a reader should know about the files, in sentences.
    pub notes: Vec<String>,
}

/// Reads the model in `directory`: `cameras`, `images` and, when there is one, `points3D`, with
/// suffix `.bin` or `.txt`. Binary wins when both exist (the text files may be rounded or old).
///
/// # Errors
/// A file is missing or malformed, an image refers to a camera that does not exist, ids or names
/// repeat, a pose has no rotation or is not finite, a focal length is not positive, an image name
/// leads out of the image folder.
pub fn read_model(directory: &Path) -> Result<ColmapModel> {
    let layout = layout_of(directory).ok_or_else(|| {
        invalid(
            directory,
            "model folder",
            "neither cameras.bin + images.bin nor cameras.txt + images.txt is here",
        )
        .with_remedy("give the folder that holds them, usually sparse/0")
    })?;
    let file = |stem: &str| directory.join(format!("{stem}.{}", layout.suffix()));
    let mut notes = Vec::new();
    if layout == Layout::Binary && directory.join("images.txt").exists() {
        notes.push("the model is there as binary and as text; the binary files were read".into());
    }
    let (cameras_path, images_path, points_path) =
        (file("cameras"), file("images"), file("points3D"));
    let points_bytes = if points_path.exists() {
        Some(read_bytes(&points_path)?)
    } else {
        notes.push(format!(
            "there is no points3D.{}: the capture has no start points",
            layout.suffix()
        ));
        None
    };
    let (cameras, images) = (read_bytes(&cameras_path)?, read_bytes(&images_path)?);
    let (cameras, images, points) = match layout {
        Layout::Binary => (
            binary::parse_cameras(&cameras, &cameras_path)?,
            binary::parse_images(&images, &images_path)?,
            points_bytes.map(|b| binary::parse_points(&b, &points_path)).transpose()?,
        ),
        Layout::Text => (
            text::parse_cameras(&cameras, &cameras_path)?,
            text::parse_images(&images, &images_path)?,
            points_bytes.map(|b| text::parse_points(&b, &points_path)).transpose()?,
        ),
    };
    let points = points.unwrap_or_default();
    let mut model = ColmapModel { images, points, notes, ..ColmapModel::default() };
    for (id, camera) in cameras {
        if model.cameras.insert(id, camera).is_some() {
            return Err(invalid(&cameras_path, format!("camera {id}"), "the id is used twice"));
        }
    }
    cross_check(&mut model, &images_path, &points_path)?;
    model.images.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(model)
}

/// Checks that span records: unique ids and names, references that exist.
fn cross_check(model: &mut ColmapModel, images_path: &Path, points_path: &Path) -> Result<()> {
    let mut ids = HashSet::with_capacity(model.images.len());
    let mut names = HashMap::with_capacity(model.images.len());
    for image in &model.images {
        let place = format!("image {}", image.id);
        if !ids.insert(image.id) {
            return Err(invalid(images_path, place, "the id is used twice"));
        }
        if let Some(other) = names.insert(image.name.as_str(), image.id) {
            let cause = format!("the name \"{}\" is also that of image {other}", image.name);
            return Err(invalid(images_path, place, cause));
        }
        if !model.cameras.contains_key(&image.camera_id) {
            let cause = format!("it refers to camera {}, which does not exist", image.camera_id);
            return Err(invalid(images_path, place, cause)
                .with_remedy("cameras and images must come from the same model"));
        }
    }
    let mut point_ids = HashSet::with_capacity(model.points.len());
    let mut dangling = 0;
    for point in &mut model.points {
        if !point_ids.insert(point.id) {
            return Err(invalid(
                points_path,
                format!("point {}", point.id),
                "the id is used twice",
            ));
        }
        let before = point.track.len();
        point.track.retain(|image| ids.contains(image));
        dangling += before - point.track.len();
    }
    if dangling > 0 {
        model.notes.push(format!(
            "{dangling} track entries name images that are not in the model; they were left out"
        ));
    }
    let mut lost = 0;
    for image in &mut model.images {
        let before = image.observations.len();
        image.observations.retain(|(_, point)| point_ids.contains(point));
        lost += before - image.observations.len();
    }
    if lost > 0 && !point_ids.is_empty() {
        model.notes.push(format!(
            "{lost} keypoints name points that are not in the model; they were left out"
        ));
    }
    Ok(())
}

/// Builds a camera from what a file says; `place` goes into the error.
pub(crate) fn checked_camera(
    path: &Path,
    place: &str,
    model: CameraModel,
    (width, height): (u64, u64),
    params: Vec<f64>,
) -> Result<Camera> {
    let error = |cause: String| Err(invalid(path, place, cause));
    if width == 0 || height == 0 || width > MAX_IMAGE_SIDE || height > MAX_IMAGE_SIDE {
        return error(format!("an image of {width} x {height} pixels is not plausible"));
    }
    if params.len() != model.parameter_count() {
        let (name, expected) = (model.name(), model.parameter_count());
        return error(format!("{name} has {expected} parameters, not {}", params.len()));
    }
    for (name, value) in model.parameter_names().iter().zip(&params) {
        if !value.is_finite() {
            return error(format!("parameter {name} is {value}"));
        }
    }
    let side = 1e3 * width.max(height) as f64;
    for (name, &value) in model.parameter_names().iter().zip(&params) {
        // A crop may leave the axis of the lens outside of the picture, but not a thousand pictures away.
        if matches!(*name, "cx" | "cy") && value.abs() > side {
            return error(format!("parameter {name} is {value}, far outside of the picture"));
        }
    }
    let lengths = if model == CameraModel::Equirectangular { 2 } else { model.focal_count() };
    for (name, &value) in model.parameter_names().iter().zip(&params).take(lengths) {
        // A focal length below a pixel or above 10^7 comes from a damaged file.
        if !(1e-3..=1e7).contains(&value) {
            return error(format!("parameter {name} is {value}, which is not a length in pixels"));
        }
    }
    Ok(Camera { model, width: width as usize, height: height as usize, params })
}

/// A pose from COLMAP's `qw qx qy qz tx ty tz`.
fn checked_pose(path: &Path, place: &str, v: &[f64; 7]) -> Result<Pose> {
    let rotation = DQuat::from_xyzw(v[1], v[2], v[3], v[0]);
    Pose::new(rotation, DVec3::new(v[4], v[5], v[6])).ok_or_else(|| {
        let cause = if v.iter().all(|c| c.is_finite()) {
            "the rotation quaternion is zero"
        } else {
            "the pose has a value that is not finite"
        };
        invalid(path, place, cause)
            .with_remedy("remove the image from the model and export it again")
    })
}

fn checked_position(path: &Path, place: &str, position: DVec3) -> Result<DVec3> {
    if position.is_finite() {
        Ok(position)
    } else {
        Err(invalid(path, place, "the position has a value that is not finite"))
    }
}

/// COLMAP writes -1 or NaN where it has computed no error.
fn known_error(error: f64) -> Option<f64> {
    (error >= 0.0 && error.is_finite()).then_some(error)
}

fn invalid(path: &Path, place: impl Into<String>, cause: impl Into<String>) -> FormatError {
    FormatError::invalid(path, place, cause)
}

fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|error| FormatError::io(path, error))
}

/// Entry point for fuzzing: the first byte chooses one of the six file parsers, the rest is the
/// file. Returns whether the bytes were a valid file; must never panic.
pub fn fuzz_one(data: &[u8]) -> bool {
    let Some((&which, file)) = data.split_first() else { return false };
    let path = PathBuf::from("fuzz");
    match which % 6 {
        0 => binary::parse_cameras(file, &path).is_ok(),
        1 => binary::parse_images(file, &path).is_ok(),
        2 => binary::parse_points(file, &path).is_ok(),
        3 => text::parse_cameras(file, &path).is_ok(),
        4 => text::parse_images(file, &path).is_ok(),
        _ => text::parse_points(file, &path).is_ok(),
    }
}

#[cfg(test)]
mod tests;
