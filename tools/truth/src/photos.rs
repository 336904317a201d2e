//! The photos of a scene that is being made.

use motes_math::srgb::encode_clipped;
use motes_scene::ImageF32;

use crate::cameras::Shot;
use crate::render::Buffers;

/// All views and the photos of the first `train` of them.
#[derive(Clone, Copy, Debug)]
pub struct Photos<'a> {
    /// Train, then test.
    pub shots: &'a [Shot],
    /// Number of photos.
    pub train: usize,
    /// Buffers of all views.
    pub guides: &'a [Buffers],
    /// Radiance of the photos.
    pub photos: &'a [ImageF32],
    /// Linear photo value over radiance.
    pub exposure: f64,
}

impl Photos<'_> {
    /// Encoded color of a photo's pixel.
    pub fn pixel(&self, view: usize, x: usize, y: usize) -> [u8; 3] {
        let linear = self.photos[view].pixel(x, y);
        std::array::from_fn(|c| encode(linear[c] * self.exposure as f32))
    }
}

/// The sRGB curve (IEC 61966-2-1), clipped and rounded to 8 bits.
pub fn encode(linear: f32) -> u8 {
    (encode_clipped(linear) * 255.0).round() as u8
}
