//! From [`Capture`] to the JSON layout.

use std::path::Path;

use motes_scene::{Capture, Pose};

use super::document::{
    CameraDocument, CaptureDocument, Conventions, ExposureResponseDocument, PoseDocument,
    ViewDocument,
};
use super::{POINTS_FILE, checked_relative_path};
use crate::documents::Document as _;
use crate::error::{FormatError, Result};

pub(super) fn capture_to_document(capture: &Capture, path: &Path) -> Result<CaptureDocument> {
    let cameras = capture.cameras.iter().map(|camera| CameraDocument {
        model: camera.model.name().to_owned(),
        width: camera.width as u64,
        height: camera.height as u64,
        params: camera.params.clone(),
    });
    let views = capture.views.iter().enumerate().map(|(i, view)| {
        Ok(ViewDocument {
            name: view.name.clone(),
            camera: view.camera as u64,
            camera_from_world: pose_to_document(&view.camera_from_world),
            image: portable(path, &format!("/views/{i}/image"), &view.image)?,
            mask: view
                .mask
                .as_ref()
                .map(|mask| portable(path, &format!("/views/{i}/mask"), mask))
                .transpose()?,
            split: view.split,
            exposure_stops: view.exposure_stops,
        })
    });
    Ok(CaptureDocument {
        format: CaptureDocument::FORMAT.into(),
        version: CaptureDocument::version(),
        conventions: Conventions::default(),
        world_origin: capture.world_origin.to_array(),
        points: (!capture.points.is_empty()).then(|| POINTS_FILE.to_owned()),
        exposure_response: capture.exposure_response.map(|response| ExposureResponseDocument {
            slope_per_stop: response.slope_per_stop,
            reference_stops: response.reference_stops,
        }),
        cameras: cameras.collect(),
        views: views.collect::<Result<_>>()?,
    })
}

pub(crate) fn pose_to_document(pose: &Pose) -> PoseDocument {
    let q = pose.rotation;
    PoseDocument { rotation_wxyz: [q.w, q.x, q.y, q.z], translation: pose.translation.to_array() }
}

/// A relative path with `/` between its parts.
fn portable(document: &Path, place: &str, file: &Path) -> Result<String> {
    let Some(text) = file.to_str() else {
        let cause = format!("the file name {} is not UTF-8", file.display());
        return Err(FormatError::invalid(document, place, cause).with_remedy("rename the file"));
    };
    let text = if cfg!(windows) { text.replace('\\', "/") } else { text.to_owned() };
    checked_relative_path(document, place, &text)?;
    Ok(text)
}
