//! The JSON layout.

use serde::Deserialize;

/// Keys that may stand at the top, in a frame, or both (the frame wins).
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct IntrinsicKeys {
    pub(super) camera_model: Option<String>,
    pub(super) camera_angle_x: Option<f64>,
    pub(super) camera_angle_y: Option<f64>,
    pub(super) fl_x: Option<f64>,
    pub(super) fl_y: Option<f64>,
    pub(super) cx: Option<f64>,
    pub(super) cy: Option<f64>,
    pub(super) w: Option<f64>,
    pub(super) h: Option<f64>,
    pub(super) k1: Option<f64>,
    pub(super) k2: Option<f64>,
    pub(super) k3: Option<f64>,
    pub(super) k4: Option<f64>,
    pub(super) p1: Option<f64>,
    pub(super) p2: Option<f64>,
    pub(super) is_fisheye: Option<bool>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Frame {
    pub(super) file_path: String,
    #[serde(default)]
    pub(super) mask_path: Option<String>,
    pub(super) transform_matrix: Vec<Vec<f64>>,
    #[serde(flatten)]
    pub(super) own: IntrinsicKeys,
}

#[derive(Debug, Deserialize)]
pub(super) struct Document {
    #[serde(flatten)]
    pub(super) shared: IntrinsicKeys,
    pub(super) frames: Vec<Frame>,
    #[serde(default)]
    pub(super) ply_file_path: Option<String>,
    #[serde(default)]
    pub(super) train_filenames: Option<Vec<String>>,
    #[serde(default)]
    pub(super) val_filenames: Option<Vec<String>>,
    #[serde(default)]
    pub(super) test_filenames: Option<Vec<String>>,
    #[serde(default)]
    pub(super) applied_transform: Option<Vec<Vec<f64>>>,
}
