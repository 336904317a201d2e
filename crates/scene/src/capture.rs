//! What was observed: cameras, posed views, sparse points.

use std::path::PathBuf;

use glam::DVec3;

use crate::{Camera, ExposureResponse, Pose};

/// The role of a view in fitting and measuring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Split {
    /// Fitted to.
    Train,
    /// Held out: never fitted to, only measured.
    Test,
}

/// One posed photo.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Unique name, normally the file name of the photo.
    pub name: String,
    /// Index into [`Capture::cameras`].
    pub camera: usize,
    /// Maps world points to this view's camera frame.
    pub camera_from_world: Pose,
    /// Image file, relative to the capture document.
    pub image: PathBuf,
    /// Mask file (8-bit, 0 = ignore), relative to the capture document.
    pub mask: Option<PathBuf>,
    /// Train or test.
    pub split: Split,
    /// Brightness setting of the camera, from the photo's metadata: `log2(t S / 100 / N²)` with the
    /// exposure time `t` in seconds, the ISO speed `S` and the f-number `N`; one more is a photo
    /// twice as bright. `None` when the metadata does not tell.
    pub exposure_stops: Option<f64>,
}

/// Points that structure from motion triangulated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparsePoints {
    /// World positions after the origin offset was subtracted.
    pub positions: Vec<[f32; 3]>,
    /// 8-bit sRGB colors, one per position.
    pub colors: Vec<[u8; 3]>,
}

impl SparsePoints {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }
}

/// Cameras, views and sparse points of one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// Shared intrinsics.
    pub cameras: Vec<Camera>,
    /// Views sorted by name.
    pub views: Vec<View>,
    /// Triangulated points; may be empty.
    pub points: SparsePoints,
    /// `source_world = world + world_origin`: what import subtracted so that single precision
    /// suffices. Double precision, source units.
    pub world_origin: DVec3,
    /// How brightness follows [`View::exposure_stops`], measured on the training views; `None` where
    /// it does not, or nothing tells.
    pub exposure_response: Option<ExposureResponse>,
}

impl Capture {
    /// Indices of the views of one split, in order.
    pub fn views_of(&self, split: Split) -> Vec<usize> {
        (0..self.views.len()).filter(|&i| self.views[i].split == split).collect()
    }

    /// Gain of a view's sRGB-encoded colors over those of a model of this capture; 1 where unknown.
    pub fn exposure_gain(&self, view: usize) -> f32 {
        let stops = self.views[view].exposure_stops;
        self.exposure_response.map_or(1.0, |response| response.gain(stops))
    }

    /// The view of this name.
    pub fn view_named(&self, name: &str) -> Option<usize> {
        self.views.iter().position(|view| view.name == name)
    }
}
