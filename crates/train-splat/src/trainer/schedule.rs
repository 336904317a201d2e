//! What depends on how far the run is: the end, learning rates, degrees, and random draws.

use motes_math::rng::keyed_rng;
use rand::RngExt;
use rand::seq::SliceRandom;
use rayon::prelude::*;

use super::Trainer;
use crate::moments::Rates;

/// Purposes of random streams.
const STREAM_ORDER: u64 = 1;
const STREAM_DROPOUT: u64 = 2;
pub(super) const STREAM_BACKGROUND: u64 = 3;

/// Gaussians per random stream.
const DRAWS: usize = 4096;

impl Trainer {
    /// Whether progress is measured in time.
    pub fn is_timed(&self) -> bool {
        self.clock.is_some()
    }

    /// Whether all steps are done.
    pub fn is_done(&self) -> bool {
        match &self.clock {
            Some(clock) => clock.is_over(),
            None => self.state.step >= self.plan.iterations,
        }
    }

    /// Share of the steps done, in [0, 1].
    pub fn progress(&self) -> f64 {
        if let Some(progress) = self.probe {
            return progress;
        }
        match &self.clock {
            Some(clock) => clock.progress,
            None => f64::from(self.state.step) / f64::from(self.plan.iterations.max(1)),
        }
    }

    /// The view of this step, or of its part `index` when a step has several.
    ///
    /// Views come in a new random order each epoch, so that every view is seen equally often.
    pub(super) fn next_view(&mut self, index: u32) -> usize {
        let views = self.views_in_use();
        let count = views.len() as u64;
        let step = u64::from(self.state.step) * u64::from(self.plan.batch_views) + u64::from(index);
        let epoch = step / count;
        if self.order.0 != epoch {
            let mut order = views;
            order.shuffle(&mut keyed_rng(self.seed, STREAM_ORDER, epoch));
            self.order = (epoch, order);
        }
        self.order.1[(step % count) as usize] as usize
    }

    /// One degree more every tenth of the run: color first, its view dependence later.
    pub(super) fn sh_degree_at(&self, progress: f64) -> u8 {
        ((progress * 10.0) as u8).min(self.plan.sh_degree)
    }

    /// Opacity factors of DropGaussian (Park et al. 2025): a rising share is left out, the rest
    /// compensates.
    pub(super) fn dropout_gains(&self, progress: f64) -> Option<Vec<f32>> {
        let share = self.plan.dropout * progress as f32;
        if share <= 0.0 {
            return None;
        }
        let kept = 1.0 / (1.0 - share);
        let mut gains = vec![kept; self.state.gaussians.len()];
        gains.par_chunks_mut(DRAWS).enumerate().for_each(|(chunk, gains)| {
            let item = u64::from(self.state.step) << 32 | chunk as u64;
            let mut rng = keyed_rng(self.seed, STREAM_DROPOUT, item);
            for gain in gains {
                if rng.random::<f32>() < share {
                    *gain = 0.0;
                }
            }
        });
        Some(gains)
    }

    pub(super) fn rates(&self, progress: f64) -> Rates {
        // The root of the number of views keeps the variance of a step (Zhao et al. 2024).
        let batch = f64::from(self.plan.batch_views).sqrt();
        // Slowing down earlier costs a short run more than the noise that it takes away.
        let until = self.options.refine_until.clamp(0.0, 0.999);
        let slowed = ((progress - until) / (1.0 - until)).max(0.0);
        let late = self.plan.lr_final.powf(slowed) * batch;
        Rates::at(&self.options, self.state.scene.extent * batch, late, progress)
    }
}
