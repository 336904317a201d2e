//! Whether a prediction is about this photo at all.
//!
//! Photo = base color x shading, and shading is smoother than base color: where a prediction of base color has an edge the photo has
//! one in the same direction. So the differences of neighboring pixels, in logarithms, correlate (the assumption of Retinex, Land &
//! McCann 1971). Those of a prediction of something else do not.

use glam::Vec3;
use motes_scene::ImageF32;

/// Correlation below which a prediction is not used.
pub(crate) const LEAST_CORRELATION: f64 = 0.15;
/// Log radiance, per channel, is taken above this.
const FLOOR: f32 = 1e-3;

/// Correlation of the edges of a predicted base color with those of its photo, -1 to 1, both `[h, w, 3]` and linear, over all
/// channels; `usable` is `false` where the photo says nothing, a negative prediction is none. None where either has no edges.
pub(crate) fn edge_correlation(
    base_color: &ImageF32,
    photo: &ImageF32,
    usable: &[bool],
) -> Option<f64> {
    let (width, height) = (photo.width, photo.height);
    let log = |image: &ImageF32, i: usize| -> Option<Vec3> {
        let v = Vec3::from_slice(&image.data[3 * i..3 * i + 3]);
        (v.min_element() >= 0.0 && usable[i]).then(|| v.max(Vec3::splat(FLOOR)).map(f32::ln))
    };
    let (mut both, mut of_base, mut of_photo) = (0.0f64, 0.0f64, 0.0f64);
    for y in 0..height {
        for x in 0..width {
            let i = y * width + x;
            let (Some(base), Some(seen)) = (log(base_color, i), log(photo, i)) else { continue };
            let right = (x + 1 < width).then_some(i + 1);
            let below = (y + 1 < height).then_some(i + width);
            for j in right.into_iter().chain(below) {
                let (Some(b), Some(s)) = (log(base_color, j), log(photo, j)) else { continue };
                let (b, s) = (b - base, s - seen);
                both += f64::from(b.dot(s));
                of_base += f64::from(b.length_squared());
                of_photo += f64::from(s.length_squared());
            }
        }
    }
    (of_base > 1e-9 && of_photo > 1e-9).then(|| both / (of_base * of_photo).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(value: impl Fn(usize, usize) -> f32) -> ImageF32 {
        let data = (0..48 * 40).flat_map(|i| [value(i % 48, i / 48); 3]).collect();
        ImageF32::from_data(48, 40, 3, data)
    }

    #[test]
    fn the_base_color_of_the_photo_agrees_and_other_ones_do_not() {
        let tile = |x: usize, y: usize| if (x / 6 + y / 6).is_multiple_of(2) { 0.6 } else { 0.2 };
        let shading = |x: usize, y: usize| 0.3 + 0.01 * x as f32 + 0.005 * y as f32;
        let photo = image(|x, y| tile(x, y) * shading(x, y));
        let all = vec![true; 48 * 40];
        let of = |base: &ImageF32| edge_correlation(base, &photo, &all);
        assert!(of(&image(tile)).unwrap() > 0.95);
        // Of another place, inverted, noise.
        assert!(of(&image(|x, y| tile(x + 3, y + 3))).unwrap() < LEAST_CORRELATION);
        assert!(of(&image(|x, y| 0.8 - tile(x, y))).unwrap() < -0.9);
        let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 251) as f32 / 251.0;
        assert!(of(&image(noise)).unwrap().abs() < LEAST_CORRELATION);
        // What is not known says nothing.
        assert_eq!(of(&image(|_, _| 0.4)), None);
        assert_eq!(of(&image(|_, _| -1.0)), None);
        let none = vec![false; 48 * 40];
        assert_eq!(edge_correlation(&image(tile), &photo, &none), None);
    }
}
