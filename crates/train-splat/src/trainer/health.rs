//! A fit looks at itself.

use motes_raster::{Modifiers, RenderOptions};

use super::Trainer;
use super::finish::JUDGES;
use crate::start::{self, PoseCheck, StartFrom};
use crate::target::TrainingImage;
use crate::watch::{Baseline, Failure, Health, SHORTEST_RUN};

/// Shares of the run at which a fit that comes to nothing is given up for another start.
const LOOKS: [f64; 2] = [0.2, 0.5];

impl Trainer {
    /// What is wrong with the fit, at the steps where another start may be tried; `None` at all others.
    ///
    /// Early on it must beat photos of one color, half-way what the whole run must beat.
    pub fn failure_on_the_way(&mut self) -> Option<Failure> {
        let (step, whole) = (self.state.step, self.plan.iterations);
        let look = LOOKS.iter().position(|share| step == (share * f64::from(whole)) as u32)?;
        if self.is_timed() || whole < SHORTEST_RUN {
            return None;
        }
        let judged_as = if look == 0 { SHORTEST_RUN } else { whole };
        self.health().failure(self.state.gaussians.len(), judged_as)
    }

    /// Where another fit of the same photos may begin when this one came to nothing. Poses that
    /// contradict the photos spoil every start.
    pub fn next_start(&self) -> Option<StartFrom> {
        if self.state.model.start.poses.as_ref().is_some_and(PoseCheck::is_contradiction) {
            return None;
        }
        self.options.start.after(self.state.model.start.from)
    }

    /// How the fit does on a few training photos, at the resolution of this point of the run.
    pub fn health(&mut self) -> Health {
        let level = self.plan.stage_at(self.progress());
        let n = self.views.len();
        let take = n.min(JUDGES);
        let background = self.background();
        let behind = self.color_behind();
        let mut baselines = Vec::with_capacity(take);
        let mut spread = None;
        for i in 0..take {
            let view = i * n / take;
            let (transform, target) = &self.views[view].levels[level];
            baselines.push(Baseline::of(target, background));
            if target.alpha.is_none() {
                continue;
            }
            let options = RenderOptions {
                background: behind,
                sh_degree_limit: Some(0),
                parameters: self.options.raster,
                ..RenderOptions::default()
            };
            let modifiers = Modifiers::with_filter(&self.state.filter_3d);
            let image = self.frame.forward(&self.state.gaussians, transform, &modifiers, &options);
            let rows = (0..image.height).flat_map(|y| image.row(3, y).iter());
            let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
            for &t in rows {
                let t = f64::from(t);
                sum += t;
                squares += t * t;
                count += 1.0;
            }
            let mean = sum / f64::max(count, 1.0);
            let deviation = (squares / f64::max(count, 1.0) - mean * mean).max(0.0).sqrt();
            spread = Some(f64::max(spread.unwrap_or(0.0), deviation));
        }
        let baseline = Baseline::mean(&baselines);
        let has_outline = self.photo_alpha_spread(level) > 0.2;
        let alpha_spread = spread.filter(|_| has_outline);
        let psnr = self.training_psnr_at(level).mean();
        Health { psnr, baseline, alpha_spread }
    }

    /// Standard deviation of the photos' opacity over the pixels of the photos looked at.
    fn photo_alpha_spread(&self, level: usize) -> f64 {
        let n = self.views.len();
        let take = n.min(JUDGES);
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for i in 0..take {
            for &a in self.views[i * n / take].levels[level].1.alpha.iter().flatten() {
                let a = f64::from(a) / 255.0;
                sum += a;
                squares += a * a;
                count += 1.0;
            }
        }
        let mean = sum / f64::max(count, 1.0);
        (squares / f64::max(count, 1.0) - mean * mean).max(0.0).sqrt()
    }

    /// Whether matches between the photos agree with their poses; looked at once.
    pub fn check_poses(&mut self, images: &[TrainingImage]) -> &PoseCheck {
        let options = &self.options;
        let start = &mut self.state.model.start;
        start.poses.get_or_insert_with(|| start::check_poses(images, options))
    }
}
