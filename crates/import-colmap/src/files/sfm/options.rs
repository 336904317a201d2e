//! What the user can choose about structure from motion.

use motes_scene::Switch;
use std::path::PathBuf;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Least contrast of a faint keypoint in the difference of Gaussians, 0 to 1; COLMAP's own is 0.0067.
pub(super) const FAINT_CONTRAST: f64 = 0.003;

/// Which program finds the poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SfmTool {
    /// pycolmap where a Python has it, else the colmap command
    #[default]
    Auto,
    /// The Python package pycolmap
    Pycolmap,
    /// The command colmap on PATH
    Colmap,
}

/// Which photos share one camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CameraSharing {
    /// One camera for all photos of one size: the photos were taken without zooming
    #[default]
    One,
    /// One camera for each size, EXIF camera and EXIF focal length
    Exif,
    /// One camera for each photo
    Each,
}

/// Which photos are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Matcher {
    /// Exhaustive up to 60 photos, else sequential
    #[default]
    Auto,
    /// Every photo with every other
    Exhaustive,
    /// Neighbors in name order: frames of a video
    Sequential,
}

/// Which keypoints are matched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Keypoints {
    /// Clear ones, and with pycolmap faint ones as well in another run where photos are left without a pose
    #[default]
    Auto,
    /// Clear ones, as COLMAP does by itself
    Clear,
    /// Faint ones as well, matched along epipolar lines: poses for more photos, in three times the time
    Faint,
}

/// How poses are found for photos without poses.
#[derive(Clone, Debug, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(default)]
#[command(next_help_heading = "Structure from motion")]
pub struct SfmOptions {
    /// Program that estimates the camera poses, with --photos
    #[arg(long, value_enum, default_value_t, value_name = "TOOL")]
    pub sfm: SfmTool,

    /// Focal length in pixels of the given photos, where EXIF lacks it or is wrong
    #[arg(long, value_name = "PIXELS", value_parser = positive)]
    pub focal: Option<f64>,

    /// COLMAP's name of the camera model to solve for
    #[arg(long, value_name = "NAME", default_value = "SIMPLE_RADIAL")]
    pub camera_model: String,

    /// Which photos share one camera
    #[arg(long, value_enum, default_value_t, value_name = "HOW")]
    pub share_camera: CameraSharing,

    /// Which pairs of photos are matched
    #[arg(long, value_enum, default_value_t, value_name = "HOW")]
    pub matcher: Matcher,

    /// Which keypoints of the photos are matched
    #[arg(long, value_enum, default_value_t, value_name = "WHICH")]
    pub keypoints: Keypoints,

    /// Triangulate start points with pycolmap for input that has poses and no points
    #[arg(long, value_enum, default_value_t, value_name = "WHEN")]
    pub triangulate: Switch,

    /// Python that has pycolmap [default: .venv/bin/python beside this program or of the checkout that it was
    /// built in, then python3 of PATH]
    #[arg(long, value_name = "FILE", env = "MOTES_PYTHON")]
    pub python: Option<PathBuf>,

    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,

    /// Folder that keeps the database and models of the solver [default: a temporary one]
    #[arg(long, value_name = "DIR")]
    pub sfm_workspace: Option<PathBuf>,
}

impl Default for SfmOptions {
    fn default() -> Self {
        Self {
            sfm: SfmTool::Auto,
            focal: None,
            camera_model: "SIMPLE_RADIAL".into(),
            share_camera: CameraSharing::One,
            matcher: Matcher::Auto,
            keypoints: Keypoints::Auto,
            triangulate: Switch::default(),
            python: None,
            seed: 0,
            sfm_workspace: None,
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("this is not a positive number of pixels".into()),
    }
}
