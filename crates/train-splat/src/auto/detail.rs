//! Whether the photos hold detail at their full size.
//!
//! What half the size loses is the difference of a photo and its reduced and enlarged copy. White
//! noise of variance `σ²` leaves `3/4 σ²` of it there (the share of frequencies that are lost), with `σ`
//! from the median of a second-difference filter that smooth structure does not excite
//! (Immerkær 1996, made robust). The rest is detail; when it is so small that no fit shows it, full
//! resolution only costs time.

use motes_math::resample::{Filter, resize};
use motes_scene::ImageU8;

use crate::target::TrainingImage;

/// Detail below this (dB of its mean square) is not worth a stage: leaving it out costs a fit of
/// 30 dB less than 0.07 dB.
pub(crate) const NEEDED_DETAIL_DB: f64 = 48.0;
/// Photos that are looked at, evenly chosen.
const PHOTOS: usize = 8;

/// Mean square of the detail of the finest octave, and of the noise in it; [0, 1]² units.
pub(crate) fn finest_octave(images: &[TrainingImage]) -> (f64, f64) {
    let take = images.len().min(PHOTOS);
    let (mut detail, mut noise) = (0.0, 0.0);
    for i in 0..take {
        let (lost, sigma2) = lost_by_halving(&images[i * images.len() / take].image);
        detail += (lost - 0.75 * sigma2).max(0.0);
        noise += 0.75 * sigma2;
    }
    let n = take.max(1) as f64;
    (detail / n, noise / n)
}

fn lost_by_halving(image: &ImageU8) -> (f64, f64) {
    let (w, h, channels) = (image.width, image.height, image.channels);
    if w < 8 || h < 8 {
        return (1.0, 0.0);
    }
    let gray: Vec<f32> = image
        .data
        .chunks_exact(channels)
        .map(|p| {
            p[..channels.min(3)].iter().map(|&v| f32::from(v)).sum::<f32>()
                / (channels.min(3) as f32 * 255.0)
        })
        .collect();
    let half = (w.div_ceil(2), h.div_ceil(2));
    let small = resize(&gray, (w, h, 1), half, Filter::Lanczos3);
    let back = resize(&small, (half.0, half.1, 1), (w, h), Filter::Lanczos3);
    let lost = gray.iter().zip(&back).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
    // [1 -2 1; -2 4 -2; 1 -2 1]: the sum of squares is 36.
    let mut responses: Vec<f32> = Vec::with_capacity(w * h);
    for y in 1..h - 1 {
        for x in 1..w - 1 {
            let at = |dx: usize, dy: usize| gray[(y + dy - 1) * w + x + dx - 1];
            let row = |dy: usize| at(0, dy) - 2.0 * at(1, dy) + at(2, dy);
            responses.push((row(0) - 2.0 * row(1) + row(2)).abs());
        }
    }
    let middle = responses.len() / 2;
    let median = *responses.select_nth_unstable_by(middle, f32::total_cmp).1;
    let sigma = f64::from(median) / 0.6745 / 6.0;
    (lost / (w * h) as f64, sigma * sigma)
}

#[cfg(test)]
mod tests {
    use motes_math::rng::keyed_rng;
    use motes_scene::{Pinhole, Pose};
    use rand::RngExt;

    use super::*;

    fn photo(value: impl FnMut(usize, usize) -> f32) -> TrainingImage {
        let (w, h) = (96, 64);
        let mut value = value;
        let data = (0..w * h)
            .flat_map(|i| [(value(i % w, i / w) * 255.0).round().clamp(0.0, 255.0) as u8; 3])
            .collect();
        TrainingImage {
            name: String::new(),
            camera: Pinhole { fx: 90.0, fy: 90.0, cx: 48.0, cy: 32.0, width: w, height: h },
            camera_from_world: Pose::IDENTITY,
            image: ImageU8::from_data(w, h, 3, data).into(),
            mask: None,
            exposure_gain: 1.0,
        }
    }

    fn smooth(x: usize, y: usize) -> f32 {
        0.5 + 0.2 * (x as f32 * 0.12).sin() * (y as f32 * 0.09).cos()
    }

    fn db(mse: f64) -> f64 {
        -10.0 * mse.max(1e-12).log10()
    }

    #[test]
    fn smooth_photos_hold_no_detail_and_sharp_ones_do() {
        let blurred = finest_octave(&[photo(smooth)]).0;
        assert!(db(blurred) > NEEDED_DETAIL_DB, "{:.1} dB", db(blurred));
        let sharp = finest_octave(&[photo(|x, y| {
            smooth(x, y) + if (x / 3 + y / 5).is_multiple_of(2) { 0.1 } else { 0.0 }
        })])
        .0;
        assert!(db(sharp) < NEEDED_DETAIL_DB - 5.0, "{:.1} dB", db(sharp));
    }

    #[test]
    fn noise_is_told_from_detail() {
        let mut rng = keyed_rng(1, 2, 3);
        let noisy = photo(|x, y| smooth(x, y) + (rng.random::<f32>() - 0.5) * 0.1);
        let (detail, noise) = finest_octave(&[noisy]);
        let expected = 0.75 * 0.01 / 12.0;
        assert!((noise / expected - 1.0).abs() < 0.3, "{noise} {expected}");
        assert!(detail < 0.3 * noise, "{detail} {noise}");
    }
}
