//! A posed photo as inverse rendering takes it.

use glam::{BVec3, Vec3};
use motes_scene::{Pinhole, Pose};

use super::radiance::Radiance;

/// A channel is clipped from this share of the most clipped one on, linear: compression blurs the rim of what is white.
const CLIPPED_CHANNEL: f32 = 0.95;

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

impl Photo {
    /// Whether the photo tells about a pixel: no mask hides it. A clipped one is as bright as the photo can say.
    pub(crate) fn is_seen(&self, pixel: usize) -> bool {
        self.usable[pixel] || self.is_clipped(pixel)
    }

    /// Whether it tells about all of its pixels.
    pub(crate) fn is_whole(&self) -> bool {
        (0..self.usable.len()).all(|i| self.is_seen(i))
    }

    /// Whether a channel of a pixel that no mask hides is clipped.
    pub(crate) fn is_clipped(&self, pixel: usize) -> bool {
        self.clipped.get(pixel).is_some_and(|clipped| *clipped)
    }

    /// Channels of a pixel that may be brighter than the photo can say.
    pub(crate) fn clipped_channels(&self, pixel: usize) -> BVec3 {
        if self.is_clipped(pixel) {
            clipped_channels(self.radiance_linear.at(pixel), self.gain)
        } else {
            BVec3::FALSE
        }
    }
}

/// Channels of a clipped pixel of a photo of this gain that are clipped: at the largest value of the photo, or at 1 in the exposure of
/// the model.
fn clipped_channels(radiance: Vec3, gain: [f32; 3]) -> BVec3 {
    let share = radiance / Vec3::from(gain).recip().min(Vec3::ONE);
    share.cmpge(Vec3::splat(CLIPPED_CHANNEL * share.max_element()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_clipped_in_one_channel_is_lit() {
        let is_burnt_out = |radiance, gain| clipped_channels(radiance, gain).all();
        let even = [1.0; 3];
        assert!(is_burnt_out(Vec3::new(1.0, 0.99, 0.97), even));
        assert!(!is_burnt_out(Vec3::new(0.92, 0.65, 0.32), even));
        assert!(!is_burnt_out(Vec3::new(0.8, 0.9, 0.6), even));
        // Plaster beside a lamp, as bright as white paper in red and green.
        assert!(!is_burnt_out(Vec3::new(1.0, 1.0, 0.9), even));
        // A photo whose white is bluish, of a longer exposure; one of a shorter exposure is cut off at 1.
        assert!(is_burnt_out(Vec3::new(0.8, 0.77, 0.74), [1.25, 1.3, 1.35]));
        assert!(is_burnt_out(Vec3::new(1.0, 0.98, 0.96), [0.7, 0.8, 0.9]));
        // A photo that its capture says is darker.
        assert!(is_burnt_out(Vec3::new(0.5, 0.49, 0.49), even));
    }

    #[test]
    fn a_blue_sky_is_clipped_in_blue() {
        let clipped = clipped_channels(Vec3::new(0.6, 0.8, 1.0), [1.0; 3]);
        assert_eq!(clipped, BVec3::new(false, false, true));
    }
}
