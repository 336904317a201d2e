//! Scores during and after a fit, on what the fit has in memory.

use std::time::Instant;

use crate::{Trainer, TrainingImage};
use motes_math::metrics::psnr_from_mse;
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, Pose};
use rayon::prelude::*;
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

/// Views scored before the clock is looked at again.
const TOGETHER: usize = 4;

impl Held {
    /// Scores the fit's current model; `None` without views.
    pub fn score(trainer: &Trainer, images: &[TrainingImage]) -> Option<Self> {
        Self::score_until(trainer, images, usize::MAX, None)
    }

    /// The same on at most `most` evenly spread views, and no more of them once `end` has come; at
    /// least a few are.
    pub fn score_until(
        trainer: &Trainer,
        images: &[TrainingImage],
        most: usize,
        end: Option<Instant>,
    ) -> Option<Self> {
        let poses: Vec<Pose> = images.iter().map(|image| image.camera_from_world).collect();
        let (background, parameters) = (trainer.background(), trainer.raster_parameters());
        let options = RenderOptions { background, parameters, ..RenderOptions::default() };
        Self::score_model(&trainer.model(), &options, images, &poses, most, end)
    }

    /// The same of any model, through cameras at `poses`, one per photo.
    pub fn score_model(
        model: &Gaussians,
        options: &RenderOptions,
        images: &[TrainingImage],
        poses: &[Pose],
        most: usize,
        end: Option<Instant>,
    ) -> Option<Self> {
        let one = |&i: &usize| {
            let image = &images[i];
            let got = render(model, &image.camera, &poses[i], options);
            let color = got.color.scaled(image.exposure_gain);
            psnr(&color.to_u8().data, image, options.background)
        };
        let mut scores: Vec<f64> = Vec::new();
        for views in spread(images.len(), most).chunks(TOGETHER) {
            if !scores.is_empty() && end.is_some_and(|end| Instant::now() >= end) {
                break;
            }
            let more: Vec<f64> = views.par_iter().with_max_len(1).map(one).collect();
            scores.extend(more);
        }
        let views = scores.len();
        (views > 0).then(|| Self { psnr: scores.iter().sum::<f64>() / views as f64, views })
    }
}

/// At most `most` of `count` indices; every beginning of the list is spread over all of them.
fn spread(count: usize, most: usize) -> Vec<usize> {
    let taken = count.min(most);
    let chosen: Vec<usize> = (0..taken).map(|i| i * count / taken.max(1)).collect();
    // Every second one, then what lies between.
    let mut order = Vec::with_capacity(taken);
    let mut step = taken.next_power_of_two().max(1);
    let mut listed = vec![false; taken];
    while order.len() < taken {
        for i in (0..taken).step_by(step) {
            if !listed[i] {
                listed[i] = true;
                order.push(chosen[i]);
            }
        }
        step = (step / 2).max(1);
    }
    order
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

/// What became of a target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TargetOutcome {
    /// The PSNR asked for, dB.
    pub psnr: f64,
    /// Whether the held-out photos reached it.
    pub reached: bool,
    /// The best measured on the way, dB; none when it was never measured.
    pub best_psnr: Option<f64>,
    /// Step of that measurement.
    pub best_step: u32,
    /// Held-out photos that decide.
    pub views: usize,
    /// Whether these are training photos set aside because the capture has no test photos.
    pub set_aside: bool,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_beginning_of_the_list_is_spread_over_all_views() {
        for (count, most) in [(0, 5), (1, 5), (7, 3), (20, usize::MAX), (23, 8), (500, 9)] {
            let order = spread(count, most);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            sorted.dedup();
            assert_eq!(sorted.len(), count.min(most), "{count} {most}");
            assert!(order.iter().all(|&i| i < count));
        }
        let order = spread(64, 64);
        assert_eq!(order[..4], [0, 32, 16, 48]);
    }
}
