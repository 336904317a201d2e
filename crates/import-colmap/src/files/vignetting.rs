//! Photos divided by what the lens takes from their corners.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec2;
use motes_formats::images::{read_image, write_png};
use motes_math::srgb;
use motes_scene::{ImageU8, Pinhole, Split, Switch};
use rayon::prelude::*;

use crate::error::{IngestError, Result};
use crate::files::photos_out::Done;
use crate::gathered::Photo;
use crate::plan::{Kind, Plan};
use crate::progress::Progress;
use crate::vignetting::{Sample, Vignetting, fit};

/// Most that a pixel is divided by, two stops: beyond it noise is all there is.
const MOST: f64 = 4.0;

/// Log cosine of 78 degrees, beyond which keypoints are not asked.
const WIDEST: f64 = -1.6;

/// A photo of the capture, before its views are made.
pub(crate) struct Shown<'a> {
    pub(crate) photo: &'a Photo,
    pub(crate) plan: &'a Plan,
    pub(crate) split: Option<Split>,
}

impl Shown<'_> {
    /// Photos without keypoints may be of another lens, and panoramas have none.
    fn counts(&self) -> bool {
        self.plan.kind != Kind::Panorama && !self.photo.observations.is_empty()
    }
}

/// Looks for vignetting in the training photos and divides the images in `folder` by it, those of held-out photos, too, and the
/// brightness of their points. What the report says; none where nothing can be told.
///
/// # Errors
/// When an image cannot be read or written, or `progress` says the user asked to stop.
pub(crate) fn correct(
    switch: Switch,
    shown: &[Shown<'_>],
    done: &mut [Done],
    points: usize,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<Option<String>> {
    if switch == Switch::Off {
        return Ok(None);
    }
    let told: Vec<Vec<Sample>> = shown
        .iter()
        .zip(&*done)
        .filter(|(s, _)| s.counts() && s.split == Some(Split::Train))
        .map(|(_, done)| samples(done))
        .collect();
    let pinholes = shown.iter().filter(|s| s.counts()).map(|s| &s.plan.pinhole);
    let corner = pinholes.map(corner_log_cosine).fold(0.0, f64::min);
    let Some(found) = fit(&told, points, corner) else { return Ok(None) };
    let is_kept = found.is_evident() || (switch == Switch::On && found.exponent > 0.0);
    if is_kept {
        divide(&found, shown, done, folder, progress)?;
    }
    Ok(Some(found.note(is_kept)))
}

fn samples(done: &Done) -> Vec<Sample> {
    let told = done.brightness.iter().zip(&done.log_cosines);
    let sample = |(&(point, log_encoded), &log_cosine): (&(usize, f64), &f64)| {
        let log_brightness = srgb::decode_f64(log_encoded.exp()).ln();
        Sample { point, log_brightness, log_cosine }
    };
    // Beside or behind the lens of a wide fisheye there is no law of cosines.
    told.map(sample).filter(|sample| sample.log_cosine > WIDEST).collect()
}

fn divide(
    found: &Vignetting,
    shown: &[Shown<'_>],
    done: &mut [Done],
    folder: &Path,
    progress: &dyn Progress,
) -> Result<()> {
    progress.begin("vignetting", shown.len());
    let finished = AtomicUsize::new(0);
    shown.par_iter().zip(done).try_for_each(|(shown, done)| {
        if progress.interrupted() {
            return Err(IngestError::Interrupted);
        }
        if shown.counts() {
            for path in &done.images {
                let path = folder.join(path);
                let mut image = read_image(&path)?;
                brighten(&mut image, &shown.plan.pinhole, found);
                write_png(&path, &image)?;
            }
            for ((_, log_encoded), log_cosine) in done.brightness.iter_mut().zip(&done.log_cosines)
            {
                let linear = srgb::decode_f64(log_encoded.exp());
                *log_encoded = srgb::encode_f64(linear * gain(found, *log_cosine)).ln();
            }
        }
        progress.advance_to(finished.fetch_add(1, Ordering::Relaxed) + 1);
        Ok(())
    })
}

/// What a pixel is multiplied with, linear.
fn gain(found: &Vignetting, log_cosine: f64) -> f64 {
    (-found.exponent * log_cosine).exp().min(MOST)
}

fn brighten(image: &mut ImageU8, pinhole: &Pinhole, found: &Vignetting) {
    let (width, channels) = (image.width, image.channels);
    let linear: Vec<f32> = (0..=255u8).map(|v| srgb::decode(f32::from(v) / 255.0)).collect();
    for (k, pixel) in image.data.chunks_exact_mut(channels).enumerate() {
        let at = DVec2::new((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
        let gain = gain(found, log_cosine(pinhole, at)) as f32;
        for value in pixel.iter_mut().take(3) {
            *value = (255.0 * srgb::encode_clipped(linear[*value as usize] * gain)).round() as u8;
        }
    }
}

/// Of the angle between a pixel and the optical axis.
fn log_cosine(pinhole: &Pinhole, at: DVec2) -> f64 {
    let [x, y] = [(at.x - pinhole.cx) / pinhole.fx, (at.y - pinhole.cy) / pinhole.fy];
    -0.5 * (x * x + y * y).ln_1p()
}

fn corner_log_cosine(pinhole: &Pinhole) -> f64 {
    let (w, h) = (pinhole.width as f64, pinhole.height as f64);
    let corners = [[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]];
    corners.map(|c| log_cosine(pinhole, c.into())).into_iter().fold(0.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photo_of_even_gray_is_even_again_and_clipped_values_and_alpha_stay() {
        let pinhole = Pinhole { fx: 60.0, fy: 60.0, cx: 32.0, cy: 24.0, width: 64, height: 48 };
        let found = Vignetting::of_exponent(4.0);
        let dark = |k: usize| {
            let at = DVec2::new((k % 64) as f64 + 0.5, (k / 64) as f64 + 0.5);
            let linear = 0.4 * (4.0 * log_cosine(&pinhole, at)).exp();
            (255.0 * srgb::encode(linear as f32)).round() as u8
        };
        let data = (0..64 * 48).flat_map(|k| [dark(k), dark(k), 255, 7]).collect();
        let mut image = ImageU8::from_data(64, 48, 4, data);
        brighten(&mut image, &pinhole, &found);
        let gray = (255.0 * srgb::encode(0.4f32)).round() as u8;
        for pixel in image.data.chunks_exact(4) {
            assert!(pixel[0].abs_diff(gray) <= 1 && pixel[0] == pixel[1], "{pixel:?} for {gray}");
            assert_eq!(pixel[2..], [255, 7]);
        }
    }

    #[test]
    fn gains_are_bounded_and_the_axis_keeps_its_light() {
        let found = Vignetting::of_exponent(40.0);
        assert_eq!((gain(&found, 0.0), gain(&found, -2.0)), (1.0, MOST));
    }
}
