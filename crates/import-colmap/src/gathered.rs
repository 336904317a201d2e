//! What every source delivers: posed photos on disk and points.

use std::path::PathBuf;

use glam::DVec3;
use motes_formats::transforms::Intrinsics;
use motes_scene::{Camera, Pose, Split};

/// Intrinsics of a photo before its pixel size is known.
#[derive(Clone, Debug)]
pub(crate) enum Lens {
    /// All is given.
    Camera(Camera),
    /// The size may come from the photo.
    Intrinsics(Intrinsics),
}

impl Lens {
    /// The camera for a photo of this size.
    pub(crate) fn camera(&self, width: usize, height: usize) -> Camera {
        match self {
            Self::Camera(camera) => camera.clone(),
            Self::Intrinsics(intrinsics) => intrinsics.camera(width, height),
        }
    }
}

/// One posed photo.
#[derive(Clone, Debug)]
pub(crate) struct Photo {
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    pub(crate) mask: Option<PathBuf>,
    pub(crate) lens: Lens,
    pub(crate) camera_from_world: Pose,
    /// Split that the source itself prescribes.
    pub(crate) split: Option<Split>,
    /// Turn the pixels by the EXIF orientation: poses are of upright photos.
    pub(crate) upright: bool,
    /// Keypoints with a 3D point: pixel in the lens' own pixel grid, index into the points.
    pub(crate) observations: Vec<([f64; 2], usize)>,
}

/// One triangulated point.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub(crate) position: DVec3,
    pub(crate) color: [u8; 3],
    /// Mean reprojection error, pixels, where the source knows it.
    pub(crate) error: Option<f64>,
    /// Indices of photos that see it, ascending, each once; empty when the source has no tracks.
    pub(crate) track: Vec<usize>,
}

/// A source, read.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gathered {
    /// Sorted by name, names unique.
    pub(crate) photos: Vec<Photo>,
    pub(crate) points: Vec<Point>,
    /// Photos that the source names or the folder holds, posed or not.
    pub(crate) photos_offered: usize,
    /// Where the poses come from, for the report.
    pub(crate) description: String,
    /// Facts worth telling.
    pub(crate) notes: Vec<String>,
    /// Things that may spoil the result, with a remedy.
    pub(crate) warnings: Vec<String>,
}
