//! From the JSON layout to a checked [`Capture`].

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use motes_scene::{Camera, CameraModel, Capture, ExposureResponse, Pose, SparsePoints, View};

use super::document::{
    CameraDocument, CaptureDocument, Conventions, ExposureResponseDocument, PoseDocument,
    ViewDocument,
};
use crate::documents::check_ranges;
use crate::error::{FormatError, Result, quoted};

/// How far a quaternion's norm may be from 1: hand-written poses with three digits pass.
const UNIT_TOLERANCE: f64 = 1e-2;

/// Checks a document and builds the capture, without its points.
///
/// # Errors
/// As [`read_capture_with_warnings`](super::read_capture_with_warnings); `path` names the document.
pub fn capture_from_document(document: &CaptureDocument, path: &Path) -> Result<Capture> {
    let invalid = |place: String, cause: String| Err(FormatError::invalid(path, place, cause));
    if document.conventions != Conventions::default() {
        let cause = "these are not the conventions of version 1";
        return Err(FormatError::not_supported(path, "/conventions", cause)
            .with_remedy("convert the numbers and leave the key out"));
    }
    check_ranges(document, path)?;
    let mut cameras = Vec::with_capacity(document.cameras.len());
    for (i, camera) in document.cameras.iter().enumerate() {
        cameras.push(camera_from_document(camera, path, &format!("/cameras/{i}"))?);
    }
    let mut names = HashMap::with_capacity(document.views.len());
    let mut views = Vec::with_capacity(document.views.len());
    for (i, view) in document.views.iter().enumerate() {
        let place = format!("/views/{i}");
        if let Some(first) = names.insert(view.name.as_str(), i) {
            let cause = format!("the name {} is also that of /views/{first}", quoted(&view.name));
            return invalid(format!("{place}/name"), cause);
        }
        views.push(view_from_document(view, cameras.len(), path, &place)?);
    }
    views.sort_by(|a, b| a.name.cmp(&b.name));
    let world_origin = finite_vector(path, "/world_origin", document.world_origin)?;
    let exposure_response = document
        .exposure_response
        .map(|response| response_from_document(response, path))
        .transpose()?;
    let points = SparsePoints::default();
    Ok(Capture { cameras, views, points, world_origin, exposure_response })
}

fn response_from_document(
    response: ExposureResponseDocument,
    path: &Path,
) -> Result<ExposureResponse> {
    let ExposureResponseDocument { slope_per_stop, reference_stops } = response;
    let response = ExposureResponse { slope_per_stop, reference_stops };
    if !response.is_plausible() {
        let cause = format!("{slope_per_stop} per stop around {reference_stops} is not plausible");
        return Err(FormatError::invalid(path, "/exposure_response", cause));
    }
    Ok(response)
}

fn camera_from_document(camera: &CameraDocument, path: &Path, place: &str) -> Result<Camera> {
    let invalid =
        |key: &str, cause: String| Err(FormatError::invalid(path, format!("{place}/{key}"), cause));
    let Some(model) = CameraModel::from_name(&camera.model) else {
        let cause = format!("{} is not a camera model of COLMAP", quoted(&camera.model));
        return invalid("model", cause);
    };
    let (width, height) = (camera.width, camera.height);
    let names = model.parameter_names();
    if camera.params.len() != names.len() {
        let (count, found) = (names.len(), camera.params.len());
        return invalid("params", format!("{} has {count} parameters, not {found}", model.name()));
    }
    for (i, (name, &value)) in names.iter().zip(&camera.params).enumerate() {
        let is_focal = i < model.focal_count();
        // Beyond these bounds a focal length comes from a damaged document.
        if !value.is_finite() || is_focal && !(1e-3..=1e7).contains(&value) {
            return invalid("params", format!("{name} is {value}"));
        }
        // A crop may leave the axis of the lens outside of the picture, but not a thousand pictures away.
        if matches!(*name, "cx" | "cy") && value.abs() > 1e3 * width.max(height) as f64 {
            return invalid("params", format!("{name} is {value}, far outside of the picture"));
        }
    }
    let params = camera.params.clone();
    Ok(Camera { model, width: width as usize, height: height as usize, params })
}

fn view_from_document(
    view: &ViewDocument,
    cameras: usize,
    path: &Path,
    place: &str,
) -> Result<View> {
    let place_of = |key: &str| format!("{place}/{key}");
    if view.name.is_empty() || view.name.chars().any(char::is_control) {
        let cause = format!("{} is not a name", quoted(&view.name));
        return Err(FormatError::invalid(path, place_of("name"), cause));
    }
    if view.camera >= cameras as u64 {
        let cause = format!("it refers to camera {}, but there are {cameras}", view.camera);
        return Err(FormatError::invalid(path, place_of("camera"), cause));
    }
    let mask = view.mask.as_ref();
    Ok(View {
        name: view.name.clone(),
        camera: view.camera as usize,
        camera_from_world: pose_from_document(
            path,
            &place_of("camera_from_world"),
            &view.camera_from_world,
        )?,
        image: checked_relative_path(path, &place_of("image"), &view.image)?,
        mask: mask.map(|m| checked_relative_path(path, &place_of("mask"), m)).transpose()?,
        split: view.split,
        exposure_stops: view.exposure_stops,
    })
}

pub(crate) fn pose_from_document(path: &Path, place: &str, pose: &PoseDocument) -> Result<Pose> {
    let [w, x, y, z] = pose.rotation_wxyz;
    let rotation = DQuat::from_xyzw(x, y, z, w);
    let norm = rotation.length();
    if !((norm - 1.0).abs() <= UNIT_TOLERANCE) {
        let cause = format!("the rotation quaternion has length {norm} instead of 1");
        return Err(FormatError::invalid(path, format!("{place}/rotation_wxyz"), cause));
    }
    let translation = finite_vector(path, &format!("{place}/translation"), pose.translation)?;
    // A quaternion that is a unit one but for rounding is kept to the bit, so that reading and
    // writing a document changes nothing.
    let rotation = if (norm - 1.0).abs() < 1e-14 { rotation } else { rotation * (1.0 / norm) };
    Ok(Pose { rotation, translation })
}

fn finite_vector(path: &Path, place: &str, vector: [f64; 3]) -> Result<DVec3> {
    let vector = DVec3::from_array(vector);
    if vector.is_finite() {
        Ok(vector)
    } else {
        Err(FormatError::invalid(path, place, format!("{vector} is not finite")))
    }
}

/// Refuses names that could open a file outside the folder of the document.
pub fn checked_relative_path(document: &Path, place: &str, name: &str) -> Result<PathBuf> {
    let problem = if name.is_empty() {
        "the file name is empty".into()
    } else if name.chars().any(char::is_control) {
        format!("the file name {} has control characters", quoted(name))
    } else if name.starts_with('/') || name.as_bytes().get(1) == Some(&b':') {
        format!("the file name {} is absolute", quoted(name))
    } else if name.contains('\\') {
        format!("the file name {} has \\ between its parts instead of /", quoted(name))
    } else if name.split('/').any(|part| part == "..") {
        format!("the file name {} leads out of the folder of the document", quoted(name))
    } else {
        return Ok(PathBuf::from(name));
    };
    Err(FormatError::invalid(document, place, problem)
        .with_remedy("files are named relative to the document, below its folder"))
}
