//! Resampling of photos through a camera change, in one pass.

use motes_math::resample::{Filter, resize_rows};
use motes_scene::ImageU8;

/// Where output pixels come from: source pixel position for an output pixel position (both with
/// pixel centers at +0.5), or nothing.
pub(crate) type Map<'a> = dyn Fn(f64, f64) -> Option<[f64; 2]> + Sync + 'a;

fn has_alpha(image: &ImageU8) -> bool {
    image.channels == 4
}

/// Multiplies colors by alpha, or the inverse: a transparent pixel must not color its
/// neighbors.
fn premultiply(pixel: &mut [f32]) {
    let alpha = pixel[3] / 255.0;
    pixel[..3].iter_mut().for_each(|c| *c *= alpha);
}

fn finish(pixel: &mut [f32], out: &mut [u8]) {
    if pixel.len() == 4 {
        let alpha = pixel[3] / 255.0;
        if alpha > 1e-3 {
            pixel[..3].iter_mut().for_each(|c| *c /= alpha);
        }
    }
    for (out, &value) in out.iter_mut().zip(pixel.iter()) {
        *out = value.clamp(0.0, 255.0).round() as u8;
    }
}

/// Resizes a whole image with Lanczos-3 on the encoded values, as other trainers do when they
/// downscale; alpha weights the colors.
pub(crate) fn resize(image: &ImageU8, width: usize, height: usize, filter: Filter) -> ImageU8 {
    let stride = image.width * image.channels;
    let size = (image.width, image.height, image.channels);
    let mut values = resize_rows(size, (width, height), filter, |y, row| {
        for (value, &byte) in row.iter_mut().zip(&image.data[y * stride..]) {
            *value = f32::from(byte);
        }
        if has_alpha(image) {
            row.chunks_exact_mut(4).for_each(premultiply);
        }
    });
    let mut data = vec![0; values.len()];
    let channels = image.channels;
    for (pixel, out) in values.chunks_exact_mut(channels).zip(data.chunks_exact_mut(channels)) {
        finish(pixel, out);
    }
    ImageU8::from_data(width, height, channels, data)
}

/// Resamples an image through a map; returns it with whether each pixel had content, when some
/// had none (those are black and transparent).
///
/// The filter is separable along the source axes and as wide as the map is steep at the pixel, so
/// undistortion and downscaling blur once, not twice. `period` is the width, pixels, after which
/// the source repeats (a panorama).
pub(crate) fn resample(
    image: &ImageU8,
    (width, height): (usize, usize),
    filter: Filter,
    period: Option<f64>,
    map: &Map<'_>,
) -> (ImageU8, Option<Vec<bool>>) {
    let channels = image.channels;
    let mut out = ImageU8::filled(width, height, channels, 0);
    let mut content = vec![true; width * height];
    let row_of = |y: usize| -> Vec<Option<[f64; 2]>> {
        (0..=width).map(|x| map(x as f64 + 0.5, y as f64 + 0.5)).collect()
    };
    let period = period.unwrap_or(f64::INFINITY);
    let (mut this, mut weights_x, mut weights_y) = (row_of(0), Vec::new(), Vec::new());
    let mut sum = vec![0.0f32; channels];
    for y in 0..height {
        let next = row_of(y + 1);
        for x in 0..width {
            let inside = |p: &[f64; 2]| {
                let slack = 0.01;
                (-slack..=image.width as f64 + slack).contains(&p[0])
                    && (-slack..=image.height as f64 + slack).contains(&p[1])
            };
            let Some(center) = this[x].filter(inside) else {
                content[y * width + x] = false;
                continue;
            };
            let (step_x, step_y) = steps(center, this[x + 1], next[x], period);
            let first_x = filter.taps(center[0], step_x, image.width, &mut weights_x);
            let first_y = filter.taps(center[1], step_y, image.height, &mut weights_y);
            sum.fill(0.0);
            for (dy, &wy) in weights_y.iter().enumerate() {
                let start = ((first_y + dy) * image.width + first_x) * channels;
                let taps = image.data[start..].chunks_exact(channels);
                accumulate(&mut sum, taps, &weights_x, wy);
            }
            finish(&mut sum, out.pixel_mut(x, y));
        }
        this = next;
    }
    let some_missing = content.contains(&false);
    (out, some_missing.then_some(content))
}

/// Adds one row of the filter's footprint.
fn accumulate<'a>(
    sum: &mut [f32],
    taps: impl Iterator<Item = &'a [u8]>,
    weights_x: &[f32],
    weight_y: f32,
) {
    match sum {
        [r, g, b] => {
            let mut row = [0.0f32; 3];
            for (tap, &w) in taps.zip(weights_x) {
                row[0] += w * f32::from(tap[0]);
                row[1] += w * f32::from(tap[1]);
                row[2] += w * f32::from(tap[2]);
            }
            *r += weight_y * row[0];
            *g += weight_y * row[1];
            *b += weight_y * row[2];
        }
        [r, g, b, alpha] => {
            for (tap, &w) in taps.zip(weights_x) {
                let weight = w * weight_y * f32::from(tap[3]);
                let opacity = weight / 255.0;
                *r += opacity * f32::from(tap[0]);
                *g += opacity * f32::from(tap[1]);
                *b += opacity * f32::from(tap[2]);
                *alpha += weight;
            }
        }
        _ => {
            for (tap, &w) in taps.zip(weights_x) {
                for (sum, &value) in sum.iter_mut().zip(tap) {
                    *sum += w * weight_y * f32::from(value);
                }
            }
        }
    }
}

/// Source pixels per output pixel along the source axes, from the neighbors to the right and
/// below; 1 where they have no content.
fn steps(
    center: [f64; 2],
    right: Option<[f64; 2]>,
    below: Option<[f64; 2]>,
    period: f64,
) -> (f64, f64) {
    let difference = |other: Option<[f64; 2]>| {
        let other = other.unwrap_or(center);
        let dx = (other[0] - center[0]).abs();
        // Across the seam of a panorama the neighbor is a whole turn away.
        (dx.min((period - dx).abs()), (other[1] - center[1]).abs())
    };
    let ((rx, ry), (bx, by)) = (difference(right), difference(below));
    (rx.hypot(bx), ry.hypot(by))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(width: usize, height: usize, channels: usize) -> ImageU8 {
        let value = |i: usize| (((i * 2_654_435_761) >> 7) % 256) as u8;
        ImageU8::from_data(
            width,
            height,
            channels,
            (0..width * height * channels).map(value).collect(),
        )
    }

    #[test]
    fn the_identity_map_copies() {
        for channels in [1, 3] {
            let image = noise(9, 7, channels);
            let (out, missing) =
                resample(&image, (9, 7), Filter::Lanczos3, None, &|x, y| Some([x, y]));
            assert_eq!(out, image);
            assert!(missing.is_none());
        }
    }

    #[test]
    fn a_scaling_map_is_the_separable_resize() {
        let image = noise(48, 36, 3);
        let scaled = |x: f64, y: f64| Some([x * 3.0, y * 3.0]);
        let (out, _) = resample(&image, (16, 12), Filter::Lanczos3, None, &scaled);
        let expected = resize(&image, 16, 12, Filter::Lanczos3);
        let worst = out.data.iter().zip(&expected.data).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(1), "{worst:?}");
    }

    #[test]
    fn transparent_pixels_do_not_bleed() {
        let mut image = ImageU8::filled(8, 8, 4, 255);
        for y in 0..8 {
            for x in 4..8 {
                image.pixel_mut(x, y).copy_from_slice(&[0, 255, 0, 0]);
            }
        }
        for y in 0..8 {
            for x in 0..4 {
                image.pixel_mut(x, y).copy_from_slice(&[200, 100, 50, 255]);
            }
        }
        for out in [
            resize(&image, 4, 4, Filter::Triangle),
            resample(&image, (4, 4), Filter::Triangle, None, &|x, y| Some([2.0 * x, 2.0 * y])).0,
        ] {
            let edge = out.pixel(1, 2);
            assert!(
                edge[3] > 128 && edge[0].abs_diff(200) <= 1 && edge[1].abs_diff(100) <= 1,
                "{edge:?}"
            );
        }
    }

    #[test]
    fn pixels_without_content_are_reported() {
        let image = noise(4, 4, 3);
        let (out, content) =
            resample(&image, (4, 4), Filter::Triangle, None, &|x, y| Some([x + 2.0, y]));
        let content = content.unwrap();
        assert_eq!(content[..4], [true, true, false, false]);
        assert_eq!(out.pixel(3, 0), [0, 0, 0]);
    }
}
