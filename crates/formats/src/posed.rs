//! Cameras and poses on their way to other programs: `transforms.json`, COLMAP models, glTF.

mod colmap;
mod gltf;
mod transforms;

pub use colmap::write_colmap_model;
pub use gltf::write_gltf_cameras;
pub use transforms::write_transforms;

use motes_scene::{Camera, Capture, Pinhole, Pose, SparsePoints, Split};

/// One posed picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedView {
    /// Name of the picture below the folder of pictures, `/` between parts.
    pub name: String,
    /// File of the picture, relative to the capture.
    pub image: String,
    /// File of the mask, relative to the capture.
    pub mask: Option<String>,
    /// Index into [`PosedViews::cameras`].
    pub camera: usize,
    /// World to camera.
    pub camera_from_world: Pose,
    /// Its role.
    pub split: Split,
}

/// Cameras, poses and points, in the world of the capture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PosedViews {
    /// Intrinsics.
    pub cameras: Vec<Camera>,
    /// Poses.
    pub views: Vec<PosedView>,
    /// Points of structure from motion.
    pub points: SparsePoints,
    /// Frames per second, when the poses are a path.
    pub fps: Option<f64>,
}

/// Folder that captures keep their pictures in.
const PICTURES: &str = "images/";

impl PosedViews {
    /// The views of a capture.
    pub fn of_capture(capture: &Capture) -> Self {
        let text = |path: &std::path::Path| path.to_string_lossy().replace('\\', "/");
        let views = capture.views.iter().map(|view| {
            let image = text(&view.image);
            PosedView {
                name: image.strip_prefix(PICTURES).unwrap_or(&image).to_owned(),
                mask: view.mask.as_deref().map(text),
                image,
                camera: view.camera,
                camera_from_world: view.camera_from_world,
                split: view.split,
            }
        });
        Self {
            views: views.collect(),
            cameras: capture.cameras.clone(),
            points: capture.points.clone(),
            fps: None,
        }
    }

    /// The frames of a camera path; equal cameras are one.
    pub fn of_path(frames: &[(Pinhole, Pose)], fps: f64) -> Self {
        let mut path = Self { fps: Some(fps), ..Self::default() };
        for (i, (pinhole, pose)) in frames.iter().enumerate() {
            let camera = Camera::from_pinhole(*pinhole);
            let known = path.cameras.iter().position(|other| *other == camera);
            let index = known.unwrap_or(path.cameras.len());
            if known.is_none() {
                path.cameras.push(camera);
            }
            let name = format!("{i:05}.png");
            path.views.push(PosedView {
                image: format!("{PICTURES}{name}"),
                name,
                mask: None,
                camera: index,
                camera_from_world: *pose,
                split: Split::Train,
            });
        }
        path
    }
}

#[cfg(test)]
mod tests;
