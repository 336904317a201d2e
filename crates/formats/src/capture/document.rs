//! The JSON layout of `capture.json`.

use motes_scene::{MAX_EXPOSURE_STOPS, Split};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::documents::Document;

/// Cameras, posed views and sparse points of one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes capture")]
pub struct CaptureDocument {
    /// `motes/capture`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// The meaning of the numbers, for readers without this schema. Fixed in version 1.
    #[serde(default)]
    pub conventions: Conventions,
    /// What import subtracted from source coordinates: `source = world + world_origin`.
    #[serde(default)]
    pub world_origin: [f64; 3],
    /// Point cloud (PLY, `x y z red green blue`), relative to this document.
    #[serde(default)]
    pub points: Option<String>,
    /// How brightness follows the views' `exposure_stops`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_response: Option<ExposureResponseDocument>,
    /// Intrinsics; views refer to them by position, from 0.
    pub cameras: Vec<CameraDocument>,
    /// Posed photos.
    #[schemars(length(min = 1))]
    pub views: Vec<ViewDocument>,
}

impl Document for CaptureDocument {
    const FORMAT: &'static str = "motes/capture";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 1;
}

/// Gain of a photo's sRGB-encoded colors over those of a model:
/// `exp(slope_per_stop * (exposure_stops - reference_stops))`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExposureResponseDocument {
    /// Natural log of the gain per stop.
    pub slope_per_stop: f64,
    /// Exposure that a model's colors stand for.
    pub reference_stops: f64,
}

/// Conventions of a capture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Conventions {
    /// Axes of the camera frame: `x right, y down, z forward`.
    pub camera_axes: String,
    /// Pixel coordinates of the center of the top-left pixel: `0.5, 0.5`.
    pub pixel_center: String,
    /// `camera_point = rotation * world_point + translation`.
    pub pose: String,
    /// Encoding of image colors: `sRGB`.
    pub colors: String,
}

impl Default for Conventions {
    fn default() -> Self {
        Self {
            camera_axes: "x right, y down, z forward".into(),
            pixel_center: "0.5, 0.5".into(),
            pose: "camera_point = rotation * world_point + translation".into(),
            colors: "sRGB".into(),
        }
    }
}

/// Intrinsics of a camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CameraDocument {
    /// COLMAP's name of the model, `PINHOLE` after import.
    pub model: String,
    /// Image width, pixels.
    #[schemars(range(min = 1, max = 131_072))]
    pub width: u64,
    /// Image height, pixels.
    #[schemars(range(min = 1, max = 131_072))]
    pub height: u64,
    /// Parameters in the model's order, lengths in pixels: `fx fy cx cy` for `PINHOLE`.
    pub params: Vec<f64>,
}

/// A posed photo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ViewDocument {
    /// Unique name, normally the file name of the photo.
    pub name: String,
    /// Position in `cameras`, from 0.
    pub camera: u64,
    /// World to camera.
    pub camera_from_world: PoseDocument,
    /// Photo, relative to this document.
    pub image: String,
    /// Mask (8-bit, 0 = ignore), relative to this document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mask: Option<String>,
    /// Role in fitting and measuring.
    #[serde(default)]
    pub split: Split,
    /// Brightness setting of the camera: `log2(t S / 100 / N^2)` with the exposure time `t` in
    /// seconds, the ISO speed `S` and the f-number `N`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -MAX_EXPOSURE_STOPS, max = MAX_EXPOSURE_STOPS))]
    pub exposure_stops: Option<f64>,
}

/// A rigid transform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PoseDocument {
    /// Unit quaternion `w, x, y, z`.
    pub rotation_wxyz: [f64; 4],
    /// World units.
    pub translation: [f64; 3],
}
