//! What can be wrong with a camera; [`crate::photography`] does it to photos.

use serde::{Deserialize, Serialize};

/// Something that is wrong with a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// Poses and points as structure from motion leaves them: 0.05 degrees, 0.1 % of the distance
    PoseNoise,
    /// Shot noise of 3,000 electrons at white, and read noise
    SensorNoise,
    /// JPEG of quality 88
    Jpeg,
    /// Cosine to the fourth of the angle to the axis
    Vignetting,
    /// Automatic exposure: a quarter of a stop from photo to photo
    ExposureDrift,
    /// Automatic white balance: 4 % of red and of blue from photo to photo
    WhiteBalanceDrift,
    /// A blur of 0.6 pixels
    Defocus,
    /// More contrast than the sRGB curve, as cameras' own pictures have
    ToneCurve,
    /// A hand that moves: up to 3 pixels in one direction
    MotionBlur,
}

impl Fault {
    /// What a phone does that is held still.
    pub const PHONE: [Self; 8] = [
        Self::PoseNoise,
        Self::SensorNoise,
        Self::Jpeg,
        Self::Vignetting,
        Self::ExposureDrift,
        Self::WhiteBalanceDrift,
        Self::Defocus,
        Self::ToneCurve,
    ];

    /// Everything at once.
    pub const ALL: [Self; 9] = [
        Self::PoseNoise,
        Self::SensorNoise,
        Self::Jpeg,
        Self::Vignetting,
        Self::ExposureDrift,
        Self::WhiteBalanceDrift,
        Self::Defocus,
        Self::ToneCurve,
        Self::MotionBlur,
    ];
}
