//! What a provider is told that makes pictures of a scene from where no photo was taken.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A view that nobody photographed: what a splat shows there, and photos of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NovelViewTask {
    /// The splat's picture of the view, faulty where photos are few.
    pub rendering: String,
    /// The camera of the view.
    pub camera: ViewCamera,
    /// Photos of the scene, the nearest first.
    #[schemars(length(min = 1))]
    pub references: Vec<PosedPicture>,
}

/// A photo and its camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PosedPicture {
    /// The photo.
    pub picture: String,
    /// Its camera.
    pub camera: ViewCamera,
}

/// A pinhole camera and its pose, in the conventions of captures: x right, y down, z forward, the middle of the first pixel at
/// (0.5, 0.5).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ViewCamera {
    /// Focal lengths, x and y, pixels.
    pub focal_px: [f64; 2],
    /// Principal point, x and y, pixels.
    pub center_px: [f64; 2],
    /// Rotation of `camera_from_world`, a unit quaternion, w first.
    pub rotation_wxyz: [f64; 4],
    /// Translation of `camera_from_world`, world units.
    pub translation: [f64; 3],
}

impl Default for ViewCamera {
    fn default() -> Self {
        Self {
            focal_px: [1.0; 2],
            center_px: [0.5; 2],
            rotation_wxyz: [1.0, 0.0, 0.0, 0.0],
            translation: [0.0; 3],
        }
    }
}

impl NovelViewTask {
    /// Names of files with their places in the request.
    pub(super) fn files(&self) -> Vec<(String, &str)> {
        let at = |i: usize| format!("/task/novel-view/references/{i}/picture");
        let references = self.references.iter().enumerate();
        let mut found = vec![("/task/novel-view/rendering".to_owned(), self.rendering.as_str())];
        found.extend(references.map(|(i, reference)| (at(i), reference.picture.as_str())));
        found
    }
}
