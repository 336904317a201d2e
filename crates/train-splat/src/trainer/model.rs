//! Which components of the model are in: what is known at the start, and how a component enters.

use motes_raster::{Modifiers, RenderOptions};
use motes_scene::Gaussians;

use super::Trainer;
use crate::auto::bands::fold_bands;
use crate::auto::probing;
use crate::auto::rules::{self, Choices};
use crate::auto::{
    BackgroundModel, Decision, ExposureModel, ModelChoice, ModelState, ProbeCost, detail,
};
use crate::background::{BackgroundColor, OpenSky, append, shell, surroundings};
use crate::exposure::{NEEDED_SPREAD, gain_spread};
use crate::loss::ColorTransform;
use crate::options::{Background, FitOptions};
use crate::plan::Plan;
use crate::start::{Start, StartFrom};
use crate::target::TrainingImage;
use crate::visits;

/// Share of the Gaussians that a shell may take.
const SHELL_SHARE: f64 = 0.2;

impl ModelState {
    /// What flags and rules say before the first step; adjusts the plan to it.
    pub(super) fn new(
        options: &FitOptions,
        plan: &mut Plan,
        images: &[TrainingImage],
        start: Option<&Gaussians>,
    ) -> Self {
        let views = images.len();
        let choices = Choices::new(options);
        let mut model = Self { sh_degree: plan.sh_degree, ..Self::default() };
        model.plan_by_rules(options, plan, images);
        // A model that is given already says what it needs, and frozen parameters cannot tell.
        model.probing = choices.is_open()
            && start.is_none()
            && options.freeze.is_empty()
            && views >= rules::MIN_VIEWS
            && probing::probe_steps(plan, 4, probing::PROBE_SHARE, probing::degree_at(plan))
                >= probing::MIN_PROBE_STEPS;
        if let (None, Some(start)) = (choices.sh_degree, start) {
            model.sh_degree = start.sh_degree.max(plan.sh_degree);
        }
        plan.sh_degree = model.sh_degree;
        model.background = choices.background.unwrap_or(BackgroundModel::None);
        model.background_decided = !model.probing || choices.background.is_some();
        model.degree_decided = !model.probing || choices.sh_degree.is_some();
        // Exposures enter once the coarse colors stand, whoever asked for them.
        model.exposure_decided = choices.exposure == Some(ExposureModel::None);
        model.note_known(&choices, views);
        model
    }

    /// Number of Gaussians, resolutions, few-view regularizers: from the photos alone.
    fn plan_by_rules(&mut self, options: &FitOptions, plan: &mut Plan, images: &[TrainingImage]) {
        if options.model != ModelChoice::Auto {
            return;
        }
        let pixels = images.iter().map(|i| i.image.width * i.image.height).sum();
        let most = rules::most_gaussians(pixels);
        if options.max_gaussians.is_none() {
            let reason = format!(
                "the photos hold {pixels} pixels, which determine at most {most} Gaussians; the \
                 preset allows {}",
                plan.max_gaussians
            );
            plan.max_gaussians = plan.max_gaussians.min(most);
            self.decisions.push(Decision::new("max-gaussians", plan.max_gaussians, "rule", reason));
        }
        let finest = plan.stages.last().map_or(1.0, |s| s.scale);
        if options.resolution_schedule.is_none() && plan.stages.len() > 1 && finest == 1.0 {
            let (found, noise) = detail::finest_octave(images);
            let db = |mse: f64| -10.0 * mse.max(1e-12).log10();
            let needed = db(found) < detail::NEEDED_DETAIL_DB;
            let reason = format!(
                "detail between half and full size: {:.1} dB, noise there {:.1} dB; a stage needs \
                 detail above {:.0} dB",
                db(found),
                db(noise),
                detail::NEEDED_DETAIL_DB
            );
            if !needed {
                plan.drop_finest_stage();
            }
            self.decisions.push(Decision::new(
                "resolution-schedule",
                plan.schedule(),
                "measured",
                reason,
            ));
        }
        let reason = format!("{} training photos; by their number", images.len());
        let kept = format!("dropout {}, max-anisotropy {}", plan.dropout, plan.max_anisotropy);
        self.decisions.push(Decision::new("few-views", kept, "rule", reason));
    }

    fn note_known(&mut self, choices: &Choices, views: usize) {
        let by_flag = || "given by a flag".to_owned();
        let mut note = |component, kept: String, by, reason| {
            self.decisions.push(Decision::new(component, kept, by, reason));
        };
        if choices.background.is_some() {
            note("background-model", self.background.name().into(), "flag", by_flag());
        } else if !self.probing {
            let reason = "no probes: too few views or steps, or a given start".to_owned();
            note("background-model", self.background.name().into(), "rule", reason);
        }
        if let Some(exposure) = choices.exposure {
            note("exposure", exposure.name().into(), "flag", by_flag());
        }
        if choices.sh_degree.is_some() {
            note("sh-degree", self.sh_degree.to_string(), "flag", by_flag());
        } else if !self.probing {
            let reason = format!("no probes; by the number of photos ({views}) or the given start");
            note("sh-degree", self.sh_degree.to_string(), "rule", reason);
        }
    }

    /// Notes what the fit starts with.
    pub(super) fn note_start(&mut self, from: StartFrom, start: &Start) {
        self.start.from = from;
        self.start.poses.clone_from(&start.poses);
        let reason = start.reason.clone();
        self.decisions.push(Decision::new("start", from.name(), "rule", reason));
    }

    /// Sets the number of steps by what the photos see of the first Gaussians; a model that was given keeps
    /// those of the preset.
    pub(super) fn plan_steps(
        &mut self,
        plan: &mut Plan,
        images: &[TrainingImage],
        means: &[[f32; 3]],
        is_new: bool,
    ) {
        if is_new && plan.longest > 1.0 {
            let seen = visits::seen_share(images, means);
            plan.lengthen(visits::steps_factor(images.len(), seen));
            let reason = visits::reason(plan, images.len(), seen);
            self.decisions.push(Decision::new("iterations", plan.iterations, "measured", reason));
        }
        self.start.steps_factor = plan.steps_factor;
    }

    /// Whether views are held out for decisions to come.
    pub(super) fn awaits_evidence(&self) -> bool {
        self.probing && !self.is_decided()
    }

    /// Whether every component is decided.
    pub fn is_decided(&self) -> bool {
        self.background_decided && self.exposure_decided && self.degree_decided
    }
}

impl Trainer {
    /// Whether per-photo exposures are being fitted.
    pub fn fits_exposure(&self) -> bool {
        self.state.model.exposure.is_fitted()
    }

    /// What brings the rendering of a training photo to its brightness: its exposure where they are
    /// fitted, times what its metadata says.
    pub(super) fn color_transform(&self, view: usize) -> ColorTransform {
        let color = match self.fits_exposure() {
            true => self.state.exposures.transform(view),
            false => ColorTransform::IDENTITY,
        };
        color.brighter(self.views[view].exposure_gain)
    }

    /// What every probe of this process took; empty after a resume past them.
    pub fn probe_costs(&self) -> &[ProbeCost] {
        &self.probe_costs
    }

    /// Puts in what a flag asked for from the start.
    pub(super) fn start_model(&mut self) {
        if self.state.model.background_decided
            && self.state.model.background != BackgroundModel::None
        {
            let all: Vec<usize> = (0..self.views.len()).collect();
            let sky = OpenSky::find(&self.state.gaussians, &self.views, &all, 0);
            self.put_background(self.state.model.background, &sky);
        }
    }

    /// Rules instead of probes: what a run has that must end on time.
    pub(super) fn leave_out_probes(&mut self) {
        let model = &mut self.state.model;
        if !model.awaits_evidence() {
            return;
        }
        let reason = "a run with a time budget makes no probes".to_owned();
        if !model.background_decided {
            let kept = model.background.name();
            let decision = Decision::new("background-model", kept, "rule", reason.clone());
            model.decisions.push(decision);
        }
        if !model.degree_decided {
            model.decisions.push(Decision::new("sh-degree", model.sh_degree, "rule", reason));
        }
        model.probing = false;
        model.background_decided = true;
        model.degree_decided = true;
    }

    /// Views that steps may use now.
    pub(super) fn views_in_use(&self) -> Vec<u32> {
        let n = self.views.len();
        let mut views: Vec<u32> = (0..n as u32).collect();
        if self.state.model.awaits_evidence() {
            let held = rules::held_out(n);
            views.retain(|view| !held.contains(view));
        }
        views
    }

    /// Color that steps composite over.
    pub(super) fn color_behind(&self) -> [f32; 3] {
        match self.state.model.background {
            BackgroundModel::Color => self.state.background.value,
            BackgroundModel::None | BackgroundModel::Shell => self.background(),
        }
    }

    /// Whether photos show a background at all, and it is not fixed by `--background`.
    pub(super) fn may_have_background(&self) -> bool {
        self.options.background == Background::Auto && !self.random_background
    }

    pub(super) fn put_background(&mut self, background: BackgroundModel, sky: &OpenSky) {
        let background =
            if self.may_have_background() { background } else { BackgroundModel::None };
        self.state.model.background = background;
        match background {
            BackgroundModel::None => {}
            BackgroundModel::Color => self.state.background = BackgroundColor::new(sky.mean),
            BackgroundModel::Shell => {
                let most = (SHELL_SHARE * self.plan.max_gaussians as f64) as usize;
                let place = self.state.scene;
                let place = (place.shell_center, place.shell_radius);
                let mut more = shell(sky, &self.views, 0, place, most);
                // A probe asks whether what photos show pays, not what is guessed beside it.
                if self.probe.is_none() {
                    let guessed = surroundings(&more, sky.mean, place, most);
                    append(&mut more, &guessed);
                }
                let state = &mut self.state;
                append(&mut state.gaussians, &more);
                let n = state.gaussians.len();
                let rows: Vec<u32> = (0..n as u32).collect();
                let old = state.moments.first.means.len();
                let fresh: Vec<bool> = (0..n).map(|i| i >= old).collect();
                let sh_row = 3 * state.gaussians.sh_coefficients();
                state.moments.gather(&rows, &fresh, sh_row);
                state.refine_stats.pull.resize(n, 0.0);
                state.refine_stats.seen.resize(n, 0);
                state.initial_gaussians += more.len();
                self.update_filter();
            }
        }
    }

    pub(super) fn put_sh_degree(&mut self, degree: u8) {
        let centers: Vec<_> = self.views.iter().map(|v| v.levels[0].0.center).collect();
        let state = &mut self.state;
        fold_bands(&mut state.gaussians, degree, &centers);
        let old = state.gaussians.sh_coefficients();
        state.gaussians = state.gaussians.with_sh_degree(degree);
        state.moments.set_sh_coefficients(old, state.gaussians.sh_coefficients());
        state.model.sh_degree = degree;
        self.plan.sh_degree = degree;
    }

    /// Photos against renderings of the model so far.
    fn brightness_sums(&mut self, level: usize) -> Vec<[[f64; 5]; 3]> {
        let options = RenderOptions {
            background: self.color_behind(),
            sh_degree_limit: Some(0),
            parameters: self.options.raster,
            ..RenderOptions::default()
        };
        let modifiers = Modifiers::default();
        let mut sums = Vec::with_capacity(self.views.len());
        for view in self.views.iter() {
            let (transform, target) = &view.levels[level];
            let image = self.frame.forward(&self.state.gaussians, transform, &modifiers, &options);
            sums.push(target.brightness_sums(image, view.exposure_gain));
        }
        sums
    }

    /// How much the photos' brightness differs.
    pub(super) fn measure_gain_spread(&mut self, level: usize) -> f64 {
        gain_spread(&self.brightness_sums(level))
    }

    /// Gives every photo an exposure, starting from the best for the model so far.
    pub(super) fn put_exposure(&mut self, exposure: ExposureModel, level: usize) {
        self.state.model.exposure = exposure;
        if exposure.is_fitted() {
            let sums = self.brightness_sums(level);
            self.state.exposures.solve(&sums, exposure == ExposureModel::Affine);
        }
    }

    /// Without views to hold out: exposures when the photos' brightness differs much.
    pub(super) fn decide_exposure_by_rule(&mut self, level: usize) {
        let spread = self.measure_gain_spread(level);
        self.state.gain_spread = spread;
        let needed = spread > NEEDED_SPREAD;
        let kept = if needed { ExposureModel::Affine } else { ExposureModel::None };
        self.put_exposure(kept, level);
        let reason = format!(
            "no probes; brightness of the photos differs by {:.1} %, the bound is {:.0} %",
            100.0 * spread,
            100.0 * NEEDED_SPREAD
        );
        self.state.model.decisions.push(Decision::new("exposure", kept.name(), "rule", reason));
    }
}
