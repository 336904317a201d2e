//! When the number of Gaussians changes, and the 3D filter that follows it.

use super::Trainer;
use crate::filter3d;
use crate::options::{Densify, FreezeGroup};
use crate::profile::{Lap, Phase};
use crate::refine::relocate::relocate;
use crate::refine::{RefineCounts, RefineLimits, refine};
use crate::state::FitState;

/// Views that the filter looks at while the fit goes on, evenly spread: with more of them its cost
/// per step would grow with the number of views. The last update looks at all.
const FILTER_VIEWS: usize = 64;

/// Share of the Gaussians above which removing the faint and the large is measured first.
const MOST_PRUNED: f64 = 0.5;
/// Change of the mean training PSNR that it may cost then, dB.
const PRUNED_DB: f64 = 0.1;

impl Trainer {
    pub(super) fn update_filter(&mut self) {
        if !self.plan.filter_3d {
            return;
        }
        let lap = Lap::start();
        let last = self.plan.stages.len() - 1;
        let all = self.views.len();
        let count = if self.is_done() { all } else { all.min(FILTER_VIEWS) };
        let views: Vec<_> =
            (0..count).map(|i| &self.views[i * all / count].levels[last].0).collect();
        self.state.filter_3d = filter3d::filter_widths(&self.state.gaussians, &views);
        self.profile.counts.filtered_gaussians += self.state.gaussians.len() as u64;
        self.profile.add(Phase::Filter, lap);
    }

    /// The limits, or such that remove nothing when these would remove most of the model and the
    /// photos say that it is missed: a fit that is fading is not to be thinned on top.
    fn harmless(&mut self, limits: RefineLimits, level: usize) -> RefineLimits {
        let n = self.state.gaussians.len();
        let kept: Vec<u32> =
            (0..n as u32).filter(|&i| limits.keeps(&self.state.gaussians, i as usize)).collect();
        if (n - kept.len()) as f64 <= MOST_PRUNED * n as f64 {
            return limits;
        }
        let before = self.training_psnr_at(level);
        let (whole, filter) = (self.state.gaussians.clone(), self.state.filter_3d.clone());
        self.keep_rows(&whole, &filter, &kept);
        let after = self.training_psnr_at(level);
        (self.state.gaussians, self.state.filter_3d) = (whole, filter);
        match !kept.is_empty() && after.is_within(&before, PRUNED_DB) {
            true => limits,
            false => RefineLimits { prune_opacity: 0.0, max_scale: f32::INFINITY, ..limits },
        }
    }

    pub(super) fn refine_if_due(&mut self) -> Option<RefineCounts> {
        let (step, every) = (self.state.step, self.plan.refine_every);
        if self.probe.is_some() || !step.is_multiple_of(every) {
            return None;
        }
        let progress = self.progress();
        let until = self.options.refine_until;
        let fixed = self.options.is_frozen(FreezeGroup::Means);
        if fixed || progress > until || self.is_done() {
            self.update_filter();
            return None;
        }
        let lap = Lap::start();
        let start = self.state.initial_gaussians as f64;
        let end = self.plan.max_gaussians as f64;
        let target = start + (end - start).max(0.0) * (progress / until.max(1e-9)).min(1.0);
        let limits = RefineLimits {
            target: (target as usize).min(self.plan.max_gaussians),
            prune_opacity: self.options.prune_opacity,
            max_scale: (self.state.scene.extent * 5.0) as f32,
            min_pull: 0.0,
        };
        let limits = self.harmless(limits, self.plan.stage_at(progress));
        let (seed, strategy) = (self.seed, self.options.densify);
        let looked = match strategy {
            Densify::Error => self.options.score_views.max(self.options.prune_views),
            Densify::Pull | Densify::Relocate => self.options.prune_views,
        };
        let mut unneeded = Vec::new();
        if looked > 0 {
            let scores = self.score_gaussians(looked, self.plan.stage_at(progress));
            if self.options.prune_views > 0 {
                unneeded = scores.unneeded;
            }
            if strategy == Densify::Error {
                self.state.refine_stats.replace(scores.error);
            }
        }
        let FitState { gaussians, moments, refine_stats: stats, .. } = &mut self.state;
        let counts = match strategy {
            Densify::Relocate => {
                for (logit, _) in
                    gaussians.opacity_logits.iter_mut().zip(&unneeded).filter(|(_, u)| **u)
                {
                    *logit = f32::NEG_INFINITY;
                }
                relocate(gaussians, moments, stats, &limits, seed, step)
            }
            Densify::Pull | Densify::Error => refine(gaussians, moments, stats, &limits, &unneeded),
        };
        self.profile.counts.refinements += 1;
        self.profile.add(Phase::Refine, lap);
        self.update_filter();
        Some(counts)
    }
}
