//! The optimiser loop, one step at a time.

use std::time::Instant;

use motes_math::rng::keyed_rng;
use motes_raster::{Frame, GaussianGradients, Modifiers, Planes, RenderOptions};
use motes_scene::{Gaussians, SparsePoints};
use rand::RngExt;
use rand::seq::SliceRandom;

use crate::error::FitError;
use crate::exposure::{Exposures, NEEDED_SPREAD, gain_spread};
use crate::filter3d;
use crate::init;
use crate::loss::{ColorTransform, PhotometricLoss};
use crate::moments::{Moments, Rates};
use crate::options::{Background, FitOptions, FreezeGroup, Switch};
use crate::plan::Plan;
use crate::priors;
use crate::refine::{RefineCounts, RefineLimits, RefineStats, refine};
use crate::state::{FitState, PhaseSeconds, StepReport};
use crate::target::{TrainingImage, TrainingView};

/// Purposes of random streams.
const STREAM_ORDER: u64 = 1;
const STREAM_DROPOUT: u64 = 2;
const STREAM_BACKGROUND: u64 = 3;

/// Share of the run after which the need for exposures is judged.
const EXPOSURE_DECISION: f64 = 0.25;

/// A fit in progress.
pub struct Trainer {
    options: FitOptions,
    plan: Plan,
    seed: u64,
    extent: f64,
    views: Vec<TrainingView>,
    random_background: bool,
    /// The state; a checkpoint is a copy of it.
    pub state: FitState,
    /// Where the time went.
    pub seconds: PhaseSeconds,
    frame: Frame,
    loss: PhotometricLoss,
    gradient_image: Option<Planes>,
    gradients: GaussianGradients,
    order: (u64, Vec<u32>),
    clock: Option<Clock>,
}

/// A run whose progress is measured in time instead of steps.
struct Clock {
    start: Instant,
    budget_seconds: f64,
}

impl Trainer {
    /// Prepares a fit of `images`, starting from `start` or else from `points`.
    pub fn new(
        images: &[TrainingImage],
        points: &SparsePoints,
        start: Option<Gaussians>,
        options: &FitOptions,
        seed: u64,
    ) -> Result<Self, FitError> {
        if images.is_empty() {
            return Err(FitError::NoViews);
        }
        let plan = Plan::new(options, images.len())?;
        let extent = init::scene_extent(images, points);
        let mut gaussians = match start {
            Some(gaussians) => gaussians,
            None if points.is_empty() => init::random(images, seed, extent, options),
            None => {
                let wanted = (options.dense_share * plan.max_gaussians as f64) as usize;
                let all = init::with_dense_points(images, points, plan.dense_step, wanted);
                init::from_points(&all, extent, options)
            }
        };
        gaussians = gaussians.with_sh_degree(plan.sh_degree);
        if gaussians.len() > plan.max_gaussians {
            // Evenly spread rows, not the first ones: points often come in spatial order.
            let n = gaussians.len();
            let rows: Vec<u32> = (0..plan.max_gaussians)
                .map(|i| (i as u64 * n as u64 / plan.max_gaussians as u64) as u32)
                .collect();
            gaussians.gather(&rows);
        }
        let scales: Vec<f64> = plan.stages.iter().map(|s| s.scale).collect();
        let views: Vec<TrainingView> = images
            .iter()
            .map(|image| TrainingView::new(image, &scales, options.alpha_mode))
            .collect();
        let has_alpha = views.iter().any(|v| v.levels[0].1.alpha.is_some());
        let random_background = match options.background {
            Background::Auto => has_alpha,
            Background::Random => true,
            Background::Black | Background::White => false,
        };
        let state = FitState {
            step: 0,
            moments: Moments::zeros(&gaussians),
            refine_stats: RefineStats::zeros(gaussians.len()),
            filter_3d: Vec::new(),
            exposures: Exposures::identity(images.len()),
            exposure_on: match options.exposure {
                Switch::Auto => None,
                switch => Some(switch == Switch::On),
            },
            gain_spread: 0.0,
            initial_gaussians: gaussians.len(),
            gaussians,
        };
        let mut trainer = Self {
            options: options.clone(),
            plan,
            seed,
            extent,
            views,
            random_background,
            state,
            seconds: PhaseSeconds::default(),
            frame: Frame::new(),
            loss: PhotometricLoss::new(),
            gradient_image: None,
            gradients: GaussianGradients::default(),
            order: (u64::MAX, Vec::new()),
            clock: None,
        };
        trainer.update_filter();
        Ok(trainer)
    }

    /// Continues from a checkpoint of the same capture, options and seed.
    pub fn resume(
        images: &[TrainingImage],
        points: &SparsePoints,
        state: FitState,
        options: &FitOptions,
        seed: u64,
    ) -> Result<Self, FitError> {
        if state.exposures.values.len() != images.len() {
            let (was, is) = (state.exposures.values.len(), images.len());
            let text = format!("it was made with {was} training views, there are {is}");
            return Err(FitError::Checkpoint(text));
        }
        let mut trainer = Self::new(images, points, Some(state.gaussians.clone()), options, seed)?;
        if trainer.plan.sh_degree != state.gaussians.sh_degree {
            return Err(FitError::Checkpoint("its SH degree differs".into()));
        }
        trainer.state = state;
        Ok(trainer)
    }

    /// Measures progress in wall time from now on: the run ends after `seconds`, however many steps
    /// that are. Such a run depends on the machine; repeat it with `--iterations` to compare.
    pub fn set_time_budget(&mut self, seconds: f64) {
        self.clock = Some(Clock { start: Instant::now(), budget_seconds: seconds });
    }

    /// Whether progress is measured in time.
    pub fn is_timed(&self) -> bool {
        self.clock.is_some()
    }

    /// Whether per-photo exposures are being fitted.
    pub fn fits_exposure(&self) -> bool {
        self.exposure_on()
    }

    /// The numbers of this run.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Length that learning rates refer to, world units.
    pub fn extent(&self) -> f64 {
        self.extent
    }

    /// Whether all steps are done.
    pub fn is_done(&self) -> bool {
        match &self.clock {
            Some(_) => self.progress() >= 1.0,
            None => self.state.step >= self.plan.iterations,
        }
    }

    /// Share of the steps done, in [0, 1].
    pub fn progress(&self) -> f64 {
        match &self.clock {
            Some(clock) => {
                (clock.start.elapsed().as_secs_f64() / clock.budget_seconds.max(1e-9)).min(1.0)
            }
            None => f64::from(self.state.step) / f64::from(self.plan.iterations.max(1)),
        }
    }

    /// The model as other programs should see it: the 3D filter folded in.
    pub fn model(&self) -> Gaussians {
        let mut gaussians = self.state.gaussians.clone();
        filter3d::bake(&mut gaussians, &self.state.filter_3d);
        gaussians
    }

    /// Rendering background outside training.
    pub fn background(&self) -> [f32; 3] {
        match self.options.background {
            Background::White => [1.0; 3],
            _ => [0.0; 3],
        }
    }

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

    /// Views in a new random order each epoch, so that every view is seen equally often.
    fn next_view(&mut self) -> usize {
        let count = self.views.len() as u64;
        let step = u64::from(self.state.step);
        let epoch = step / count;
        if self.order.0 != epoch {
            let mut order: Vec<u32> = (0..count as u32).collect();
            order.shuffle(&mut keyed_rng(self.seed, STREAM_ORDER, epoch));
            self.order = (epoch, order);
        }
        self.order.1[(step % count) as usize] as usize
    }

    /// One degree more every tenth of the run: colour first, its view dependence later.
    fn sh_degree_at(&self, progress: f64) -> u8 {
        ((progress * 10.0) as u8).min(self.plan.sh_degree)
    }

    fn exposure_on(&self) -> bool {
        self.state.exposure_on == Some(true)
    }

    /// Once the coarse colours stand, measures how much the photos' brightness differs.
    fn decide_exposure(&mut self, progress: f64, stage: usize) {
        if self.state.exposure_on.is_some() || progress < EXPOSURE_DECISION {
            return;
        }
        let options = RenderOptions {
            background: self.background(),
            sh_degree_limit: Some(0),
            ..RenderOptions::default()
        };
        let modifiers = Modifiers::default();
        let mut pairs = Vec::with_capacity(self.views.len());
        for view in &self.views {
            let (transform, target) = &view.levels[stage];
            let image = self.frame.forward(&self.state.gaussians, transform, &modifiers, &options);
            pairs.push(target.brightness_pairs(image));
        }
        self.state.gain_spread = gain_spread(&pairs);
        self.state.exposure_on = Some(self.state.gain_spread > NEEDED_SPREAD);
    }

    /// Opacity factors of DropGaussian (Park et al. 2025): a rising share is left out, the rest
    /// compensates.
    fn dropout_gains(&self, progress: f64) -> Option<Vec<f32>> {
        let share = self.plan.dropout * progress as f32;
        if share <= 0.0 {
            return None;
        }
        let mut rng = keyed_rng(self.seed, STREAM_DROPOUT, u64::from(self.state.step));
        let kept = 1.0 / (1.0 - share);
        let draw = |_| if rng.random::<f32>() < share { 0.0 } else { kept };
        Some((0..self.state.gaussians.len()).map(draw).collect())
    }

    fn rates(&self, progress: f64) -> Rates {
        use FreezeGroup::{Colors, Means, Opacities, Rotations, Scales};
        let o = &self.options;
        let late = self.plan.lr_final.powf(progress);
        let rate = |group, value: f64| if o.is_frozen(group) { 0.0 } else { value as f32 };
        Rates {
            // Falls to 1 % at the end, exponentially.
            means: rate(Means, o.lr_means * self.extent * 0.01f64.powf(progress)),
            rotations: rate(Rotations, o.lr_rotations * late),
            log_scales: rate(Scales, o.lr_scales * late),
            opacity_logits: rate(Opacities, o.lr_opacities * late),
            sh0: rate(Colors, o.lr_sh0 * late),
            sh_rest: rate(Colors, o.lr_sh_rest * late),
        }
    }

    fn update_filter(&mut self) {
        if self.plan.filter_3d {
            let last = self.plan.stages.len() - 1;
            let views: Vec<_> = self.views.iter().map(|v| &v.levels[last].0).collect();
            self.state.filter_3d = filter3d::filter_widths(&self.state.gaussians, &views);
        }
    }

    fn refine_if_due(&mut self) -> Option<RefineCounts> {
        let (step, every) = (self.state.step, self.plan.refine_every);
        if !step.is_multiple_of(every) {
            return None;
        }
        let progress = self.progress();
        let until = self.options.refine_until;
        let fixed = self.options.is_frozen(FreezeGroup::Means);
        if fixed || progress > until || self.is_done() {
            self.update_filter();
            return None;
        }
        let start = self.state.initial_gaussians as f64;
        let end = self.plan.max_gaussians as f64;
        let target = start + (end - start).max(0.0) * (progress / until.max(1e-9)).min(1.0);
        let limits = RefineLimits {
            target: (target as usize).min(self.plan.max_gaussians),
            prune_opacity: self.options.prune_opacity,
            max_scale: (self.extent * 5.0) as f32,
            min_pull: 0.0,
        };
        let state = &mut self.state;
        let counts =
            refine(&mut state.gaussians, &mut state.moments, &mut state.refine_stats, &limits);
        self.update_filter();
        Some(counts)
    }
}
