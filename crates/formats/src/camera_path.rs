//! `camera-path.json`: poses to render one after another.

use std::path::Path;

use motes_scene::{Pinhole, Pose};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::capture::{PoseDocument, pose_from_document, pose_to_document};
use crate::documents::{Document, Parsed, check_ranges, read_document, write_document};
use crate::error::Result;

/// Poses to render one after another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes camera path")]
pub struct CameraPathDocument {
    /// `motes/camera-path`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Frame width, pixels.
    #[schemars(range(min = 1, max = 32_768))]
    pub width: u64,
    /// Frame height, pixels.
    #[schemars(range(min = 1, max = 32_768))]
    pub height: u64,
    /// Frames per second of the video.
    #[serde(default = "default_fps")]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1000))]
    pub fps: f64,
    /// Angle of view over the frame height, degrees.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 180))]
    pub vertical_fov_deg: f64,
    /// One per frame.
    #[schemars(length(min = 1))]
    pub poses: Vec<PathPoseDocument>,
}

impl Document for CameraPathDocument {
    const FORMAT: &'static str = "motes/camera-path";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 0;
}

/// The camera of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PathPoseDocument {
    /// World to camera; x right, y down, z forward.
    pub camera_from_world: PoseDocument,
    /// Angle of view of this frame, degrees, where it differs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 180))]
    pub vertical_fov_deg: Option<f64>,
}

fn default_fps() -> f64 {
    30.0
}

/// A checked camera path.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    /// Frames per second of the video.
    pub fps: f64,
    /// Camera and `camera_from_world` of every frame; all frames have one size.
    pub frames: Vec<(Pinhole, Pose)>,
}

impl CameraPathDocument {
    /// A path of one camera. The principal point must be in the middle and pixels square: the
    /// document has no keys for anything else.
    pub fn new(camera: &Pinhole, fps: f64, poses: &[Pose]) -> Self {
        let half_height = camera.height as f64 / 2.0;
        let pose = |pose: &Pose| PathPoseDocument {
            camera_from_world: pose_to_document(pose),
            vertical_fov_deg: None,
        };
        Self {
            format: Self::FORMAT.into(),
            version: Self::version(),
            width: camera.width as u64,
            height: camera.height as u64,
            fps,
            vertical_fov_deg: 2.0 * (half_height / camera.fy).atan().to_degrees(),
            poses: poses.iter().map(pose).collect(),
        }
    }

    /// Checks the document; `path` names it in errors.
    ///
    /// # Errors
    /// As [`read_camera_path`].
    pub fn check(&self, path: &Path) -> Result<CameraPath> {
        check_ranges(self, path)?;
        let mut frames = Vec::with_capacity(self.poses.len());
        for (i, pose) in self.poses.iter().enumerate() {
            let place = format!("/poses/{i}");
            let fov = pose.vertical_fov_deg.unwrap_or(self.vertical_fov_deg);
            let place = format!("{place}/camera_from_world");
            let camera_from_world = pose_from_document(path, &place, &pose.camera_from_world)?;
            frames
                .push((pinhole(self.width as usize, self.height as usize, fov), camera_from_world));
        }
        Ok(CameraPath { fps: self.fps, frames })
    }
}

/// A camera with its principal point in the middle and square pixels.
fn pinhole(width: usize, height: usize, vertical_fov_deg: f64) -> Pinhole {
    let (cx, cy) = (width as f64 / 2.0, height as f64 / 2.0);
    let focal = cy / (vertical_fov_deg.to_radians() / 2.0).tan();
    Pinhole { fx: focal, fy: focal, cx, cy, width, height }
}

/// Reads a camera path.
///
/// # Errors
/// The file cannot be read or is malformed; there are no poses; a size, angle, frame rate or pose
/// is impossible.
pub fn read_camera_path(path: &Path) -> Result<CameraPath> {
    let Parsed { document, .. } = read_document::<CameraPathDocument>(path)?;
    document.check(path)
}

/// Writes a camera path.
///
/// # Errors
/// Writing fails.
pub fn write_camera_path(path: &Path, document: &CameraPathDocument) -> Result<()> {
    write_document(path, document)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_survives_as_its_angle() {
        let camera = pinhole(640, 480, 50.0);
        let poses = [Pose::IDENTITY; 2];
        let document = CameraPathDocument::new(&camera, 24.0, &poses);
        let path = document.check(Path::new("p.json")).unwrap();
        assert_eq!((path.fps, path.frames.len()), (24.0, 2));
        let (read, pose) = path.frames[1];
        assert!((read.fx - camera.fx).abs() < 1e-9 && (read.fy - camera.fy).abs() < 1e-9);
        assert_eq!((read.cx, read.cy, pose), (320.0, 240.0, Pose::IDENTITY));
    }

    #[test]
    fn a_pose_may_zoom() {
        let mut document = CameraPathDocument::new(&pinhole(64, 48, 50.0), 30.0, &[Pose::IDENTITY]);
        document.poses[0].vertical_fov_deg = Some(90.0);
        let path = document.check(Path::new("p.json")).unwrap();
        assert!((path.frames[0].0.fy - 24.0).abs() < 1e-9);
        document.poses[0].vertical_fov_deg = Some(180.0);
        let error = document.check(Path::new("p.json")).unwrap_err().to_string();
        assert!(
            error.contains(
                "180.0 is not a number above 0 and below 180 (/poses/0/vertical_fov_deg)"
            ),
            "{error}"
        );
    }
}
