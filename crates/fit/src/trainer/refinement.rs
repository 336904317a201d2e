//! When the number of Gaussians changes, and the 3D filter that follows it.

use super::Trainer;
use crate::filter3d;
use crate::options::FreezeGroup;
use crate::refine::{RefineCounts, RefineLimits, refine};

impl Trainer {
    pub(super) fn update_filter(&mut self) {
        if self.plan.filter_3d {
            let last = self.plan.stages.len() - 1;
            let views: Vec<_> = self.views.iter().map(|v| &v.levels[last].0).collect();
            self.state.filter_3d = filter3d::filter_widths(&self.state.gaussians, &views);
        }
    }

    pub(super) fn refine_if_due(&mut self) -> Option<RefineCounts> {
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
