//! Runs whose length is asked for in seconds.
//!
//! A few views are rendered and differentiated before the first step. That gives the machine's speed
//! on this capture, and with it the time that every point of the measured front would take; the
//! settings are interpolated to the time at hand. From then on each step advances the progress by
//! the share of the remaining work that the remaining time allows, so the run ends on time whatever
//! else the machine does, and passes through its whole schedule.

use std::time::{Duration, Instant};

use motes_raster::{Modifiers, Planes, RenderOptions};

use super::Trainer;
use crate::error::FitError;
use crate::front::{FRONT, Settings, settings_for};
use crate::loss::{ColorTransform, add_terms};
use crate::moments::Moments;
use crate::plan::Plan;
use crate::profile::Phase;
use crate::refine::RefineStats;

/// Growth of the kernels' time per pixel with the number of Gaussians, as an exponent: more of them
/// are smaller, and the lists of a tile grow slowly (monstree at 512: 1.4 times the pairs from 12k
/// to 32k Gaussians).
const PIXEL_GROWTH: f64 = 0.3;
/// Share of the time that one measurement may cost; larger pictures are extrapolated.
const MEASURED_SHARE: f64 = 0.02;
/// Weight of the newest step in the running means.
const NEWEST: f64 = 0.1;
/// Slices of the integral over the rest of the run.
const SLICES: usize = 64;

/// What a step costs on this machine, wall seconds.
#[derive(Clone, Debug)]
struct Speed {
    /// Kernels and loss of one view per stage, at `gaussians`.
    pixels: Vec<f64>,
    /// Everything else, per Gaussian of one view.
    gaussian: f64,
    /// The number of Gaussians when measured.
    gaussians: f64,
}

impl Speed {
    fn step(&self, stage: usize, gaussians: f64, batch: u32) -> f64 {
        let growth = (gaussians.max(1.0) / self.gaussians.max(1.0)).powf(PIXEL_GROWTH);
        f64::from(batch) * (self.pixels[stage] * growth + self.gaussian * gaussians)
    }

    /// Seconds that the progress from `from` to 1 would take at one step per unit of progress.
    fn rest(&self, plan: &Plan, from: f64, gaussians: f64, refine_until: f64) -> f64 {
        let width = (1.0 - from).max(0.0) / SLICES as f64;
        let most = plan.max_gaussians as f64;
        let sum: f64 = (0..SLICES)
            .map(|i| {
                let progress = from + (i as f64 + 0.5) * width;
                let grown = (progress - from) / (refine_until - from).max(1e-9);
                let n = gaussians + (most - gaussians).max(0.0) * grown.clamp(0.0, 1.0);
                self.step(plan.stage_at(progress), n, plan.batch_views)
            })
            .sum();
        sum * width
    }
}

/// Progress by wall time.
pub(super) struct Clock {
    end: Instant,
    pub(super) progress: f64,
    speed: Speed,
    last: Instant,
    /// Kernel and loss seconds at `last`.
    pixel_seconds: f64,
}

impl Clock {
    pub(super) fn is_over(&self) -> bool {
        self.progress >= 1.0 || Instant::now() >= self.end
    }
}

/// What a timed run was given.
#[derive(Clone, Copy, Debug)]
pub struct TimeBudget {
    /// When all must be done, writing and scoring included.
    pub end: Instant,
    /// Photos to be scored afterwards.
    pub scored_views: usize,
}

/// Share of the budget that scoring may take: the rest of the photos stay unscored.
const SCORE_SHARE: f64 = 0.06;
/// Bytes per second at which the product is written, as a guess on the safe side.
const WRITE_RATE: f64 = 2e8;

impl Trainer {
    /// Measures progress in wall time from now on. Unless the options name a preset, the settings
    /// become those of the measured front for the time at hand. Such a run depends on the machine;
    /// repeat it with `--iterations` to compare.
    ///
    /// # Errors
    /// When an option cannot be used.
    pub fn set_time_budget(&mut self, budget: &TimeBudget) -> Result<(), FitError> {
        let began = Instant::now();
        self.leave_out_probes();
        let whole = budget.end.saturating_duration_since(began).as_secs_f64();
        let (speed, full_forward) = self.measure_speed(whole);
        let scoring = |gaussians: usize| {
            let one = full_forward + gaussians as f64 * 0.3 * speed.gaussian;
            (budget.scored_views as f64 * one).min(SCORE_SHARE * whole)
        };
        let row = (14 + self.state.gaussians.sh.len() / self.state.gaussians.len().max(1)) * 4;
        let written = |gaussians: usize| (gaussians * row) as f64 / WRITE_RATE;
        let left = budget.end.saturating_duration_since(Instant::now()).as_secs_f64();
        if self.options.preset.is_none() {
            let predict = |settings: &Settings| -> Result<f64, FitError> {
                let plan = self.timed_plan(settings)?;
                let start = self.state.gaussians.len().min(plan.max_gaussians);
                let rest = speed.rest(&plan, 0.0, start as f64, self.options.refine_until);
                let after = scoring(plan.max_gaussians) + written(plan.max_gaussians);
                Ok(f64::from(plan.iterations) * rest + after)
            };
            let mut predicted = [0.0; FRONT.len()];
            for (seconds, settings) in predicted.iter_mut().zip(&FRONT) {
                *seconds = predict(settings)?;
            }
            let settings = settings_for(left, &predicted);
            let sh_degree = self.plan.sh_degree;
            self.plan = Plan { sh_degree, ..self.timed_plan(&settings)? };
            self.keep_at_most(self.plan.max_gaussians);
        }
        let most = self.plan.max_gaussians;
        let reserve = Duration::from_secs_f64(scoring(most) + written(most) + 0.01);
        self.clock = Some(Clock {
            end: budget.end.checked_sub(reserve).unwrap_or(began),
            progress: 0.0,
            speed,
            last: Instant::now(),
            pixel_seconds: self.pixel_seconds(),
        });
        Ok(())
    }

    /// The plan of these settings, without the stage that the photos hold no detail for.
    fn timed_plan(&self, settings: &Settings) -> Result<Plan, FitError> {
        let mut plan = Plan::with_settings(&self.options, settings, self.views.len())?;
        plan.lengthen(self.plan.steps_factor);
        while plan.stages.len() > self.views[0].levels.len() {
            plan.drop_finest_stage();
        }
        Ok(plan)
    }

    /// Evenly spread Gaussians, when there are more than `most`.
    fn keep_at_most(&mut self, most: usize) {
        let n = self.state.gaussians.len();
        if n <= most {
            return;
        }
        let rows: Vec<u32> =
            (0..most).map(|i| (i as u64 * n as u64 / most as u64) as u32).collect();
        self.state.gaussians.gather(&rows);
        self.state.moments = Moments::zeros(&self.state.gaussians);
        self.state.refine_stats = RefineStats::zeros(most);
        self.state.initial_gaussians = most;
        self.update_filter();
    }

    /// The speed of steps, and the wall seconds of a forward pass at full resolution.
    fn measure_speed(&mut self, whole: f64) -> (Speed, f64) {
        let stages = self.plan.stages.len();
        let gaussians = self.state.gaussians.len() as f64;
        let mut speed = Speed { pixels: vec![0.0; stages], gaussian: 0.0, gaussians };
        let mut forward = 0.0;
        // Coarse first, twice: the first one also warms caches up.
        for stage in std::iter::once(0).chain(0..stages) {
            let pixels = |stage: usize| {
                let [w, h] = self.views[0].levels[stage].0.size;
                (w * h) as f64
            };
            if stage > 0 {
                let factor = pixels(stage) / pixels(stage - 1).max(1.0);
                let expected = speed.pixels[stage - 1] * factor;
                forward *= factor;
                speed.pixels[stage] = expected;
                if expected + speed.gaussian * gaussians > MEASURED_SHARE * whole {
                    continue;
                }
            }
            let times = self.time_one_view(stage);
            speed.pixels[stage] = times[0];
            speed.gaussian = times[1] / gaussians.max(1.0);
            forward = times[2];
        }
        (speed, forward)
    }

    /// Wall seconds of kernels and loss, of everything else, and of the forward kernels.
    fn time_one_view(&mut self, stage: usize) -> [f64; 3] {
        let (transform, target) = &self.views[0].levels[stage];
        let _: usize = target.width;
        let start = Instant::now();
        let (background, parameters) = (self.background(), self.options.raster);
        let options = RenderOptions { background, parameters, ..RenderOptions::default() };
        let modifiers = Modifiers::with_filter(&self.state.filter_3d);
        let gaussians = &self.state.gaussians;
        let image = self.frame.forward(gaussians, transform, &modifiers, &options);
        let [width, height] = transform.size;
        let mut gradient = Planes::new(width, height, 4);
        let loss_start = Instant::now();
        let weight = self.options.ssim_weight;
        let identity = ColorTransform::IDENTITY;
        let mut value =
            self.loss.evaluate(image, target, background, identity, weight, &mut gradient);
        let terms = &self.options.loss_terms;
        add_terms(terms, image, target, background, identity, &mut value, &mut gradient);
        let loss = loss_start.elapsed().as_secs_f64();
        self.frame.backward(gaussians, &modifiers, &options, &gradient, &mut self.gradients);
        let whole = start.elapsed().as_secs_f64();
        let stats = &self.frame.stats;
        let forward = stats.forward.as_secs_f64();
        let pixels = forward + stats.backward.as_secs_f64() + loss;
        [pixels, (whole - pixels).max(0.0), forward]
    }

    /// Wall seconds of kernels and loss so far.
    fn pixel_seconds(&self) -> f64 {
        [Phase::Forward, Phase::Loss, Phase::Backward].map(|p| self.profile.wall_s(p)).iter().sum()
    }

    /// Moves the progress of a timed run on by the step just done at `stage`.
    pub(super) fn advance_clock(&mut self, stage: usize) {
        let pixel_seconds = self.pixel_seconds();
        let Some(clock) = &mut self.clock else { return };
        let now = Instant::now();
        let batch = f64::from(self.plan.batch_views);
        let gaussians = self.state.gaussians.len() as f64;
        let pixels = (pixel_seconds - clock.pixel_seconds) / batch;
        let other = ((now - clock.last).as_secs_f64() / batch - pixels).max(0.0);
        let speed = &mut clock.speed;
        let growth = (gaussians.max(1.0) / speed.gaussians.max(1.0)).powf(PIXEL_GROWTH);
        let old = speed.pixels[stage];
        let new = old + NEWEST * (pixels / growth - old);
        // What made this stage slower or faster will do the same to the later ones.
        let ratio = if old > 0.0 { (new / old).clamp(0.5, 2.0) } else { 1.0 };
        speed.pixels[stage] = new;
        for later in &mut speed.pixels[stage + 1..] {
            *later *= ratio;
        }
        speed.gaussian += NEWEST * (other / gaussians.max(1.0) - speed.gaussian);
        (clock.last, clock.pixel_seconds) = (now, pixel_seconds);

        let left = clock.end.saturating_duration_since(now).as_secs_f64();
        let rest = speed.rest(&self.plan, clock.progress, gaussians, self.options.refine_until);
        clock.progress = match left > rest * 1e-6 {
            true => (clock.progress + rest / left).min(1.0),
            false => 1.0,
        };
    }
}
