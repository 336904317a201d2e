//! A picture of a map for people.

use motes_math::median::quantile;
use motes_math::srgb;
use motes_scene::{ImageF32, ImageU8};

/// Share of the map that may be white.
const WHITE: f32 = 0.98;

/// The map, exposed so that nearly all of it is below white, sRGB-encoded.
pub(super) fn preview(map: &ImageF32) -> ImageU8 {
    let mut brightest: Vec<f32> =
        map.data.chunks_exact(3).map(|p| p.iter().fold(0.0f32, |a, b| a.max(*b))).collect();
    let white = quantile(&mut brightest, WHITE).filter(|w| *w > 0.0).unwrap_or(1.0);
    let mut shown = map.clone();
    shown.data.iter_mut().for_each(|v| *v = srgb::encode((*v / white).clamp(0.0, 1.0)));
    shown.to_u8()
}
