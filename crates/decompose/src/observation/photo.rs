//! A posed photo as inverse rendering takes it.

use motes_scene::{Pinhole, Pose};

use super::radiance::Radiance;

/// A photo of the capture.
#[derive(Clone, Debug)]
pub struct Photo {
    /// Name of its view.
    pub name: String,
    /// Intrinsics at the size of the picture.
    pub camera: Pinhole,
    /// Maps world points to the camera's frame.
    pub camera_from_world: Pose,
    /// `[h, w, 3]`, linear, brought to the exposure of the model (sRGB values divided by the view's gain and decoded, then divided by
    /// [`Self::gain`]).
    pub radiance_linear: Radiance,
    /// Exposure and white balance of the photo over those of the model, linear factors; 1 where they are not modeled.
    pub gain: [f32; 3],
    /// Which light it was taken under: photos of one capture share one.
    pub light: usize,
    /// Row by row: `false` where a mask says ignore or any channel of the photo is clipped.
    pub usable: Vec<bool>,
    /// Row-major: where a channel is clipped that no mask hides; empty for nowhere.
    pub clipped: Vec<bool>,
}
