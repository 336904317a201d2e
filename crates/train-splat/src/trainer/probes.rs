//! Short fits that each differ in one component, compared on views that none of them saw.

use std::sync::Arc;

use motes_raster::{Frame, GaussianGradients, Modifiers, RenderOptions};

use super::Trainer;
use crate::auto::criterion::{Colors, Evidence, Residuals};
use crate::auto::probing;
use crate::auto::rules::{self, Choices};
use crate::auto::{BackgroundModel, Candidate, Decision, ExposureModel, ProbeCost};
use crate::background::OpenSky;
use crate::clock::cpu_seconds;
use crate::exposure::NEEDED_SPREAD;
use crate::loss::PhotometricLoss;
use crate::profile::Profile;

/// Below this share of the photos' pixels that no Gaussian covers, a background has nothing to show.
const NEEDED_OPEN_SHARE: f64 = 0.02;
/// Below this spread of log gains no probe is spent on exposures: 5 % of a gray of one half is an error of
/// 32 dB. Exposures that differ less are predicted no better for a photo that nobody took, which is shown
/// in the mean of all.
const PROBED_SPREAD: f64 = 0.05;

/// Residuals of a probe on the held-out views.
struct Probe {
    raw: Residuals,
    corrected: Residuals,
    gaussians: usize,
    sh_degree: u8,
}

impl Probe {
    fn seen(&self, colors: Colors) -> &Residuals {
        match colors {
            Colors::Raw => &self.raw,
            Colors::Corrected => &self.corrected,
        }
    }
}

/// Values stored per Gaussian at an SH degree.
fn stored(degree: u8) -> usize {
    11 + 3 * (usize::from(degree) + 1).pow(2)
}

impl Trainer {
    /// Decides what is due at this point of the run.
    pub(super) fn decide_model(&mut self, progress: f64) {
        if self.probe.is_some() {
            return;
        }
        if !self.state.model.background_decided {
            self.decide_background();
        }
        if !self.state.model.exposure_decided && progress >= probing::EXPOSURE_AT {
            let level = self.plan.stage_at(probing::EXPOSURE_AT);
            match Choices::new(&self.options).exposure {
                Some(exposure) => self.put_exposure(exposure, level),
                None if self.state.model.probing => self.decide_exposure(level),
                None => self.decide_exposure_by_rule(level),
            }
            self.state.model.exposure_decided = true;
            self.order.0 = u64::MAX;
        }
        if !self.state.model.degree_decided && progress >= probing::degree_at(&self.plan) {
            self.decide_degree();
            self.state.model.degree_decided = true;
            // Views that were held out join.
            self.order.0 = u64::MAX;
        }
    }

    fn decide_background(&mut self) {
        self.state.model.background_decided = true;
        let mut decision = Decision::new("background-model", "none", "measured", String::new());
        if !self.may_have_background() {
            decision.reason = "photos with alpha, or --background was given".into();
            self.state.model.decisions.push(decision);
            return;
        }
        let in_use: Vec<usize> = {
            let held = rules::held_out(self.views.len());
            (0..self.views.len()).filter(|v| !held.contains(&(*v as u32))).collect()
        };
        let sky = OpenSky::find(&self.state.gaussians, &self.views, &in_use, 0);
        decision.reason = format!(
            "{:.1} % of the photos' pixels are covered by no start point (probes from {:.0} % on)",
            100.0 * sky.share,
            100.0 * NEEDED_OPEN_SHARE
        );
        if sky.share >= NEEDED_OPEN_SHARE {
            decision.by = "probe".into();
            let held = std::mem::replace(&mut self.state.model.background_decided, false);
            let steps = probing::probe_steps(&self.plan, 3, probing::PROBE_SHARE / 3.0, 0.0);
            let base = self.run_probe("background-model none", (0.0, steps), |_| {});
            let mut best = (BackgroundModel::None, 0.0);
            for background in [BackgroundModel::Color, BackgroundModel::Shell] {
                let name = format!("background-model {}", background.name());
                let probe = self
                    .run_probe(&name, (0.0, steps), |fork| fork.put_background(background, &sky));
                let shared = if background == BackgroundModel::Color { 3 } else { 0 };
                let growth = probe.gaussians as f64 / base.gaussians.max(1) as f64;
                let candidate = self.judge(
                    (background.name(), "none"),
                    (&base, &probe, Colors::Raw),
                    (shared, growth),
                );
                let score = candidate.evidence_nats - candidate.cost_nats;
                if candidate.pays && score > best.1 {
                    best = (background, score);
                }
                decision.candidates.push(candidate);
            }
            self.state.model.background_decided = held;
            decision.kept = best.0.name().into();
            if best.0 != BackgroundModel::None {
                // The run itself starts from all photos.
                let all: Vec<usize> = (0..self.views.len()).collect();
                let sky = OpenSky::find(&self.state.gaussians, &self.views, &all, 0);
                self.put_background(best.0, &sky);
            }
        }
        self.state.model.decisions.push(decision);
        self.order.0 = u64::MAX;
    }

    fn decide_exposure(&mut self, level: usize) {
        self.state.gain_spread = self.measure_gain_spread(level);
        let reason = format!(
            "brightness of the photos differs by {:.1} % (probes from {:.0} % on, gains from {:.0} % on)",
            100.0 * self.state.gain_spread,
            100.0 * PROBED_SPREAD,
            100.0 * NEEDED_SPREAD
        );
        let mut decision = Decision::new("exposure", "none", "measured", reason);
        let kept = match self.state.gain_spread {
            // No probe: what explains the brightness of single photos otherwise, floaters, takes hundreds of steps to grow.
            // Offsets are not taken unasked: no sensor has them.
            spread if spread >= NEEDED_SPREAD => ExposureModel::Gain,
            spread if spread >= PROBED_SPREAD => self.probe_exposures(level, &mut decision),
            _ => ExposureModel::None,
        };
        decision.kept = kept.name().into();
        self.put_exposure(kept, level);
        self.state.model.decisions.push(decision);
    }

    /// The exposure model that pays most; notes the candidates.
    fn probe_exposures(&mut self, level: usize, decision: &mut Decision) -> ExposureModel {
        decision.by = "probe".into();
        let share = probing::PROBE_SHARE / 3.0;
        let steps = probing::probe_steps(&self.plan, 3, share, probing::EXPOSURE_AT);
        let at = (probing::EXPOSURE_AT, steps);
        let without = self.run_probe("exposure none", at, |_| {});
        let mut best = (ExposureModel::None, 0.0);
        for exposure in [ExposureModel::Gain, ExposureModel::Affine] {
            let name = format!("exposure {}", exposure.name());
            let probe = self.run_probe(&name, at, |fork| fork.put_exposure(exposure, level));
            let candidate = self.judge(
                (exposure.name(), "none"),
                (&without, &probe, Colors::Corrected),
                (exposure.parameters(self.views.len()), 1.0),
            );
            let score = candidate.evidence_nats - candidate.cost_nats;
            if candidate.pays && score > best.1 {
                best = (exposure, score);
            }
            decision.candidates.push(candidate);
        }
        best.0
    }

    /// The degree that the fit has used so far against 0, and those between where it pays; the best by
    /// evidence less cost.
    fn decide_degree(&mut self) {
        let colors = if self.fits_exposure() { Colors::Corrected } else { Colors::Raw };
        let top = self.state.model.sh_degree;
        let reason = format!("{top} against 0, and degrees between where it pays");
        let mut decision = Decision::new("sh-degree", 0, "probe", reason);
        let probed = |of: &str| {
            let mut all = self.state.model.decisions.iter();
            all.any(|d| d.component == of && d.by == "probe")
        };
        // What the other components left unused; by the state, so that a resumed fit decides alike.
        let used = f64::from(u8::from(probed("background-model")) + u8::from(probed("exposure")));
        let share = probing::PROBE_SHARE * (1.0 - used / 3.0);
        let progress = probing::degree_at(&self.plan);
        let probes = usize::from(top) + 1;
        let at = (progress, probing::probe_steps(&self.plan, probes, share, progress));
        let base = self.run_probe("sh-degree 0", at, |fork| fork.put_sh_degree(0));
        let (mut best, mut kept) = (0.0, 0);
        for degree in (1..=top).rev() {
            if degree < top && kept == 0 {
                break;
            }
            let name = format!("sh-degree {degree}");
            let probe = self.run_probe(&name, at, |fork| fork.put_sh_degree(degree));
            let growth = stored(degree) as f64 / stored(0) as f64;
            let candidate =
                self.judge((&degree.to_string(), "0"), (&base, &probe, colors), (0, growth));
            let score = candidate.evidence_nats - candidate.cost_nats;
            if candidate.pays && score > best {
                (best, kept) = (score, degree);
            }
            decision.candidates.push(candidate);
        }
        decision.kept = kept.to_string();
        self.state.model.decisions.push(decision);
        self.put_sh_degree(kept);
    }

    fn judge(
        &self,
        (value, against): (&str, &str),
        (without, with, colors): (&Probe, &Probe, Colors),
        (shared, growth): (usize, f64),
    ) -> Candidate {
        let (a, b) = (without.seen(colors), with.seen(colors));
        let views = self.views.len();
        let held = rules::held_out(views).len() as f64;
        // Corrected colors are judged on half of each view.
        let share = a.count() / without.raw.count().max(1.0);
        let evidence = Evidence::new(a, b, views as f64, held * share);
        let cost = evidence.cost(shared, growth);
        let per_gaussian = stored(without.sh_degree) as f64 * without.gaussians as f64;
        Candidate {
            value: value.into(),
            against: against.into(),
            psnr_without: a.psnr(),
            psnr_with: b.psnr(),
            evidence_nats: evidence.nats,
            error_nats: evidence.error,
            cost_nats: cost,
            parameters: shared + ((growth - 1.0) * per_gaussian).round() as usize,
            pays: evidence.exceeds(cost),
        }
    }

    /// Changes a copy of the fit, continues it for a few steps without the held-out views, and
    /// measures it on them.
    fn run_probe(
        &mut self,
        name: &str,
        (progress, steps): (f64, u32),
        change: impl FnOnce(&mut Self),
    ) -> Probe {
        let start = cpu_seconds();
        let mut fork = self.fork(progress);
        change(&mut fork);
        for _ in 0..steps {
            fork.step();
        }
        let probe = fork.measure_held_out(self.plan.stage_at(progress));
        let name = name.to_owned();
        self.probe_costs.push(ProbeCost { name, steps, cpu_seconds: cpu_seconds() - start });
        probe
    }

    fn fork(&self, progress: f64) -> Self {
        Self {
            options: self.options.clone(),
            plan: self.plan.clone(),
            seed: self.seed,
            views: Arc::clone(&self.views),
            view_weights: Arc::clone(&self.view_weights),
            random_background: self.random_background,
            state: self.state.clone(),
            profile: Profile::default(),
            frame: Frame::new(),
            loss: PhotometricLoss::new(),
            gradient_image: None,
            gradients: GaussianGradients::default(),
            batch: GaussianGradients::default(),
            order: (u64::MAX, Vec::new()),
            clock: None,
            probe: Some(progress),
            probe_costs: Vec::new(),
        }
    }

    fn measure_held_out(&mut self, level: usize) -> Probe {
        let options = RenderOptions {
            background: self.color_behind(),
            parameters: self.options.raster,
            ..RenderOptions::default()
        };
        let modifiers = Modifiers::with_filter(&self.state.filter_3d);
        let mut probe = Probe {
            raw: Residuals::default(),
            corrected: Residuals::default(),
            gaussians: self.state.gaussians.len(),
            sh_degree: self.state.gaussians.sh_degree,
        };
        for view in rules::held_out(self.views.len()) {
            let gain = self.views[view as usize].exposure_gain;
            let (transform, target) = &self.views[view as usize].levels[level];
            let image = self.frame.forward(&self.state.gaussians, transform, &modifiers, &options);
            probe.raw.add(image, gain, target, Colors::Raw);
            probe.corrected.add(image, gain, target, Colors::Corrected);
        }
        probe
    }
}
