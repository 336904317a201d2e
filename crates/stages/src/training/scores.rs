//! Scores during and after a fit, on what the fit has in memory.

use motes_fit::{Trainer, TrainingImage};
use motes_math::metrics::psnr_from_mse;
use motes_raster::{RenderOptions, render};
use serde::Serialize;

/// Mean scores of a set of views: PSNR per view from the 8-bit render over the pixels that count,
/// then the mean; capped at 128 dB.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Held {
    /// dB
    pub psnr: f64,
    /// Number of views.
    pub views: usize,
}

impl Held {
    /// Scores the fit's current model; `None` without views.
    pub fn score(trainer: &Trainer, images: &[TrainingImage]) -> Option<Self> {
        if images.is_empty() {
            return None;
        }
        let model = trainer.model();
        let background = trainer.background();
        let options = RenderOptions { background, ..RenderOptions::default() };
        let sum: f64 = images
            .iter()
            .map(|image| {
                let got = render(&model, &image.camera, &image.camera_from_world, &options);
                psnr(&got.color.to_u8().data, image, background)
            })
            .sum();
        Some(Self { psnr: sum / images.len() as f64, views: images.len() })
    }
}

/// A quality to stop at, written `psnr=25`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Target {
    /// dB on the held-out photos.
    pub psnr: f64,
}

impl std::str::FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let value = text.strip_prefix("psnr=").and_then(|v| v.parse::<f64>().ok());
        match value.filter(|v| v.is_finite()) {
            Some(psnr) => Ok(Self { psnr }),
            None => Err("expected psnr=NUMBER, for example psnr=25".into()),
        }
    }
}

fn psnr(render: &[u8], image: &TrainingImage, background: [f32; 3]) -> f64 {
    let channels = image.image.channels;
    let (mut sum, mut count) = (0.0, 0u64);
    for (i, (r, p)) in
        render.chunks_exact(3).zip(image.image.data.chunks_exact(channels)).enumerate()
    {
        if image.mask.as_ref().is_some_and(|mask| mask.data[i] < 128) {
            continue;
        }
        let alpha = if channels == 4 { f64::from(p[3]) / 255.0 } else { 1.0 };
        for c in 0..3 {
            let photo = f64::from(p[c]) * alpha + 255.0 * f64::from(background[c]) * (1.0 - alpha);
            sum += ((f64::from(r[c]) - photo.round()) / 255.0).powi(2);
            count += 1;
        }
    }
    psnr_from_mse(sum / count.max(1) as f64).min(128.0)
}
