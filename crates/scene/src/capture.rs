//! What was observed: cameras, posed views, sparse points.

use std::path::PathBuf;

use clap::ValueEnum;
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Camera, ExposureResponse, Pose};

/// The role of a view in fitting and measuring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Fitted to.
    #[default]
    Train,
    /// Held out: never fitted to, only measured.
    Test,
}

/// Views of one split, or of both.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
#[value(rename_all = "lower")]
pub enum SplitChoice {
    /// Views that were held out.
    #[default]
    Test,
    /// Views that were fitted to.
    Train,
    /// All views.
    All,
}

impl Split {
    /// The word of flags and documents.
    pub fn name(self) -> &'static str {
        SplitChoice::from(self).name()
    }
}

impl From<Split> for SplitChoice {
    fn from(split: Split) -> Self {
        match split {
            Split::Train => Self::Train,
            Split::Test => Self::Test,
        }
    }
}

impl SplitChoice {
    /// `None` for all.
    pub fn split(self) -> Option<Split> {
        match self {
            Self::Test => Some(Split::Test),
            Self::Train => Some(Split::Train),
            Self::All => None,
        }
    }

    /// Whether views of a split are among the chosen ones.
    pub fn includes(self, split: Split) -> bool {
        self.split().is_none_or(|chosen| chosen == split)
    }

    /// The word of flags and documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::Test => "test",
            Self::Train => "train",
            Self::All => "all",
        }
    }
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

    /// The view of this name, or the only one that differs by the suffix of a picture: `IMG_1` and `IMG_1.jpg` are the same.
    pub fn view_named(&self, name: &str) -> Option<usize> {
        view_among(self.views.iter().map(|view| view.name.as_str()), name)
    }
}

/// [`Capture::view_named`] among the names of views.
pub fn view_among<'n>(views: impl Iterator<Item = &'n str> + Clone, name: &str) -> Option<usize> {
    let exact = views.clone().position(|view| view == name);
    exact.or_else(|| {
        let bare = name.rsplit_once('.').filter(|(_, suffix)| is_picture(suffix)).map(|n| n.0);
        let mut found =
            views.enumerate().filter(|(_, view)| stem_of(view) == name || Some(*view) == bare);
        found.next().filter(|_| found.next().is_none()).map(|(i, _)| i)
    })
}

fn is_picture(suffix: &str) -> bool {
    const SUFFIXES: [&str; 8] = ["jpg", "jpeg", "png", "tif", "tiff", "webp", "bmp", "exr"];
    SUFFIXES.iter().any(|s| s.eq_ignore_ascii_case(suffix))
}

/// The name of a view without the suffix of its file; folders stay.
pub fn stem_of(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((stem, suffix)) if !suffix.contains(['/', '\\']) => {
            // `.hidden` and `folder/.hidden` are names, not suffixes.
            if stem.is_empty() || stem.ends_with(['/', '\\']) { name } else { stem }
        }
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_is_named_with_or_without_suffix() {
        let names = ["a.jpg", "b.png", "b.jpg", "c", "d/e.f.png", "g.2"];
        let named = |name| view_among(names.into_iter(), name);
        for (name, view) in [
            ("a.jpg", Some(0)),
            ("a", Some(0)),
            ("c", Some(3)),
            ("c.png", Some(3)),
            ("d/e.f", Some(4)),
            ("g.2", Some(5)),
            // Two views, a suffix that another view has, no picture, nothing.
            ("b", None),
            ("a.png", None),
            ("c.2", None),
            ("e.f", None),
        ] {
            assert_eq!(named(name), view, "{name}");
        }
    }
}
