//! One optimiser step: render, compare, differentiate, update.

use std::time::Instant;

use motes_math::rng::keyed_rng;
use motes_raster::{Modifiers, Planes, RenderOptions};
use rand::RngExt;

use super::Trainer;
use super::schedule::STREAM_BACKGROUND;
use crate::loss::ColorTransform;
use crate::options::FreezeGroup;
use crate::priors;
use crate::state::StepReport;

impl Trainer {
    /// One optimiser step on one view.
    pub fn step(&mut self) -> StepReport {
        let progress = self.progress();
        let stage = self.plan.stage_at(progress);
        self.decide_exposure(progress, stage);
        let view = self.next_view();
        let step = self.state.step;
        let (transform, target) = &self.views[view].levels[stage];

        let background = if self.random_background {
            let mut rng = keyed_rng(self.seed, STREAM_BACKGROUND, u64::from(step));
            std::array::from_fn(|_| rng.random())
        } else {
            self.background()
        };
        let gains = self.dropout_gains(progress);
        let modifiers = Modifiers {
            filter_3d: (!self.state.filter_3d.is_empty()).then_some(&self.state.filter_3d[..]),
            opacity_gain: gains.as_deref(),
        };
        let render_options = RenderOptions {
            background,
            sh_degree_limit: Some(self.sh_degree_at(progress)),
            ..RenderOptions::default()
        };
        let exposure_on = self.exposure_on();
        let image =
            self.frame.forward(&self.state.gaussians, transform, &modifiers, &render_options);

        let start = Instant::now();
        let [width, height] = transform.size;
        let mut gradient = self
            .gradient_image
            .take()
            .filter(|g| [g.width, g.height] == transform.size)
            .unwrap_or_else(|| Planes::new(width, height, 4));
        let color = match exposure_on {
            true => self.state.exposures.transform(view),
            false => ColorTransform::IDENTITY,
        };
        let loss = self.loss.evaluate(
            image,
            target,
            background,
            color,
            self.options.ssim_weight,
            &mut gradient,
        );
        self.seconds.loss += start.elapsed().as_secs_f64();

        self.frame.backward(
            &self.state.gaussians,
            &modifiers,
            &render_options,
            &gradient,
            &mut self.gradients,
        );
        self.seconds.add_frame(&self.frame.stats);
        self.gradient_image = Some(gradient);

        let start = Instant::now();
        self.state.refine_stats.add(&self.gradients);
        priors::add_gradients(&self.plan, self.extent, &self.state.gaussians, &mut self.gradients);
        let rates = self.rates(progress);
        let state = &mut self.state;
        state.moments.apply(&mut state.gaussians, &self.gradients, &rates, u64::from(step) + 1);
        if exposure_on {
            state.exposures.step(view, &loss);
        }
        state.step += 1;
        if !self.options.is_frozen(FreezeGroup::Scales) {
            priors::limit_shapes(&self.plan, self.extent, &mut self.state.gaussians);
        }
        self.seconds.optimise += start.elapsed().as_secs_f64();

        let start = Instant::now();
        let refined = self.refine_if_due();
        self.seconds.refine += start.elapsed().as_secs_f64();
        StepReport { view, loss, refined }
    }
}
