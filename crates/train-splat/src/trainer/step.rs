//! One optimizer step: render, compare, differentiate, update.

use motes_math::rng::keyed_rng;
use motes_raster::{GaussianGradients, Modifiers, Planes, RenderOptions};
use rand::RngExt;
use rayon::prelude::*;

use super::Trainer;
use super::schedule::STREAM_BACKGROUND;
use crate::auto::{BackgroundModel, ExposureModel};
use crate::loss::{LossValue, add_terms};
use crate::moments::Update;
use crate::options::{AdamRule, Densify, FreezeGroup};
use crate::priors;
use crate::profile::{Lap, Phase};
use crate::refine::relocate::add_noise;
use crate::state::StepReport;

/// Photos resampled together when the next one is missing: enough for all threads.
const PREPARED: usize = 8;
/// Values per task when gradients are added.
const SUM_CHUNK: usize = 16_384;

impl Trainer {
    /// One optimizer step.
    pub fn step(&mut self) -> StepReport {
        let progress = self.progress();
        let stage = self.plan.stage_at(progress);
        self.decide_model(progress);
        let gains = self.dropout_gains(progress);
        let views = self.plan.batch_views;
        let mut report =
            StepReport { view: 0, loss: LossValue::default(), pixels: 0, refined: None };
        let mut differentiated = 0;
        for index in 0..views {
            let view = self.next_view(index);
            self.prepare_targets(view, stage);
            let (loss, skipped) =
                self.differentiate(view, index, gains.as_deref(), progress, stage);
            let [width, height] = self.views[view].levels[stage].0.size;
            report.pixels += (width * height) as u64;
            (report.view, report.loss) = (view, loss);
            if skipped {
                continue;
            }
            differentiated += 1;
            if views > 1 {
                let lap = Lap::start();
                let first = differentiated == 1;
                accumulate(&mut self.batch, &mut self.gradients, first, 1.0 / views as f32);
                self.profile.add(Phase::Optimize, lap);
            }
        }
        if views > 1 {
            std::mem::swap(&mut self.batch, &mut self.gradients);
        }
        self.state.step += 1;
        self.profile.counts.steps += 1;
        if differentiated > 0 {
            self.update(progress);
        }
        report.refined = self.refine_if_due();
        self.advance_clock(stage);
        report
    }

    /// Resamples the photo of `view` and of the next ones at this resolution, where they are missing.
    fn prepare_targets(&mut self, view: usize, stage: usize) {
        if self.views[view].levels[stage].1.is_built() {
            return;
        }
        let lap = Lap::start();
        let order = &self.order.1;
        let here = order.iter().position(|&v| v as usize == view).unwrap_or(0);
        let missing: Vec<usize> = order[here..]
            .iter()
            .map(|&v| v as usize)
            .filter(|&v| !self.views[v].levels[stage].1.is_built())
            .take(PREPARED)
            .collect();
        missing.par_iter().with_max_len(1).for_each(|&v| {
            let _: usize = self.views[v].levels[stage].1.width;
        });
        self.profile.add(Phase::Resample, lap);
    }

    /// The color behind view `index` of the batch.
    fn background_of(&self, index: u32) -> [f32; 3] {
        if !self.random_background {
            return self.color_behind();
        }
        let item = u64::from(self.state.step) * u64::from(self.plan.batch_views);
        let mut rng = keyed_rng(self.seed, STREAM_BACKGROUND, item + u64::from(index));
        std::array::from_fn(|_| rng.random())
    }

    /// Loss of one view and, unless it may be left out, its gradient in `self.gradients`.
    fn differentiate(
        &mut self,
        view: usize,
        index: u32,
        gains: Option<&[f32]>,
        progress: f64,
        stage: usize,
    ) -> (LossValue, bool) {
        let (transform, target) = &self.views[view].levels[stage];
        let exposure_gain = self.views[view].exposure_gain;
        let background = self.background_of(index);
        let modifiers =
            Modifiers { opacity_gain: gains, ..Modifiers::with_filter(&self.state.filter_3d) };
        let render_options = RenderOptions {
            background,
            sh_degree_limit: Some(self.sh_degree_at(progress)),
            parameters: self.options.raster,
            ..RenderOptions::default()
        };
        let exposure = self.state.model.exposure;
        let color = self.color_transform(view);
        let gaussians = &self.state.gaussians;
        let lap = Lap::start();
        let image = self.frame.forward(gaussians, transform, &modifiers, &render_options);

        let loss_lap = Lap::start();
        let mut gradient = planes_of_size(self.gradient_image.take(), transform.size);
        let mut loss = self.loss.evaluate(
            image,
            target,
            background,
            color,
            self.options.ssim_weight,
            &mut gradient,
        );
        let terms = &self.options.loss_terms;
        add_terms(terms, image, target, background, color, &mut loss, &mut gradient);
        weigh(&mut gradient, self.view_weights.get(view).copied());
        if self.state.model.background == BackgroundModel::Color {
            self.state.background.step(image, &gradient);
        }
        let loss_seconds = loss_lap.elapsed();
        self.profile.add_seconds(Phase::Loss, loss_seconds);
        self.profile.add_forward(
            lap,
            loss_seconds,
            &self.frame.stats,
            transform.size,
            gaussians.len(),
        );

        let share =
            if progress > self.options.refine_until { self.options.skip_backward } else { 0.0 };
        let skipped = self.state.skip.visit(view, loss.loss, share);
        if !skipped {
            let lap = Lap::start();
            self.frame.backward(
                gaussians,
                &modifiers,
                &render_options,
                &gradient,
                &mut self.gradients,
            );
            self.profile.add_backward(lap, &self.frame.stats);
            let lap = Lap::start();
            let seen = self.state.refine_stats.add(&self.gradients);
            self.profile.counts.gaussians_seen += seen;
            if exposure.is_fitted() {
                let offsets = exposure == ExposureModel::Affine;
                self.state.exposures.step(view, exposure_gain, &loss, offsets);
            }
            self.profile.add(Phase::Optimize, lap);
        }
        self.gradient_image = Some(gradient);
        (loss, skipped)
    }

    /// Adam on the gradients of this step.
    fn update(&mut self, progress: f64) {
        let lap = Lap::start();
        priors::add_gradients(
            &self.plan,
            self.state.scene.extent,
            &self.state.gaussians,
            &mut self.gradients,
        );
        let rates = self.rates(progress);
        let update = Update {
            step: u64::from(self.state.step),
            sh_degree: self.sh_degree_at(progress),
            sh_every: self.options.sh_every,
            sparse: self.options.adam == AdamRule::Visible,
        };
        let state = &mut self.state;
        state.moments.apply(&mut state.gaussians, &self.gradients, &rates, &update);
        if self.options.densify == Densify::Relocate && rates.means > 0.0 {
            add_noise(&mut state.gaussians, rates.means, self.seed, state.step);
        }
        if !self.options.is_frozen(FreezeGroup::Scales) {
            priors::limit_shapes(&self.plan, self.state.scene.extent, &mut self.state.gaussians);
        }
        self.profile.add(Phase::Optimize, lap);
    }
}

/// Planes for a gradient: those of the step before where they have this size.
fn planes_of_size(before: Option<Planes>, size: [usize; 2]) -> Planes {
    let fits = before.filter(|planes| [planes.width, planes.height] == size);
    fits.unwrap_or_else(|| Planes::new(size[0], size[1], 4))
}

/// Lets a picture count less than a photo. Its loss stays how far the model is from it.
fn weigh(gradient: &mut Planes, weight: Option<f32>) {
    if let Some(weight) = weight.filter(|weight| *weight < 1.0) {
        gradient.data.iter_mut().for_each(|g| *g *= weight);
    }
}

/// `sum += factor · new`, or `sum = factor · new` for the `first`; `new` may lose its buffers.
fn accumulate(sum: &mut GaussianGradients, new: &mut GaussianGradients, first: bool, factor: f32) {
    if first {
        std::mem::swap(sum, new);
    }
    let add = |sum: &mut [f32], new: &[f32]| {
        sum.par_chunks_mut(SUM_CHUNK).zip(new.par_chunks(SUM_CHUNK)).for_each(|(sum, new)| {
            for (sum, new) in sum.iter_mut().zip(new) {
                *sum += factor * new;
            }
        });
    };
    let scale = |sum: &mut [f32]| {
        sum.par_chunks_mut(SUM_CHUNK).for_each(|sum| sum.iter_mut().for_each(|s| *s *= factor));
    };
    let columns = [
        (sum.means.as_flattened_mut(), new.means.as_flattened()),
        (sum.rotations.as_flattened_mut(), new.rotations.as_flattened()),
        (sum.log_scales.as_flattened_mut(), new.log_scales.as_flattened()),
        (&mut sum.opacity_logits[..], &new.opacity_logits[..]),
        (&mut sum.sh[..], &new.sh[..]),
    ];
    for (sum, new) in columns {
        if first {
            scale(sum);
        } else {
            add(sum, new);
        }
    }
}

#[cfg(test)]
mod tests {
    use motes_testkit::random_gaussians;

    use super::*;

    #[test]
    fn the_gradient_of_several_views_is_their_mean() {
        let gaussians = random_gaussians(1, 3, 1);
        let gradients = |value: f32| {
            let mut g = GaussianGradients::default();
            g.reset(&gaussians);
            g.means[1] = [value; 3];
            g.sh.fill(2.0 * value);
            g
        };
        let mut sum = GaussianGradients::default();
        for (i, value) in [1.0f32, 2.0, 6.0].into_iter().enumerate() {
            accumulate(&mut sum, &mut gradients(value), i == 0, 1.0 / 3.0);
        }
        assert!((sum.means[1][2] - 3.0).abs() < 1e-6 && sum.means[0] == [0.0; 3]);
        assert!(sum.sh.iter().all(|v| (v - 6.0).abs() < 1e-5));
    }
}
