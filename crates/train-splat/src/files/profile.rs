//! The table of `--profile`: where the time went.

use std::fmt;

use crate::{PhaseTime, Profile, UnitTimes, WorkCounts};
use serde::Serialize;

/// Times per phase, counts, and times per unit of work.
#[derive(Clone, Debug, Serialize)]
pub struct ProfileReport {
    /// Threads that worked.
    pub threads: usize,
    /// Wall and CPU seconds per phase.
    pub phases: Vec<PhaseTime>,
    /// What no phase accounts for.
    pub other_wall_s: f64,
    /// The same in CPU seconds.
    pub other_cpu_s: f64,
    /// What was done.
    pub counts: WorkCounts,
    /// CPU nanoseconds per unit of work.
    pub units: UnitTimes,
}

impl ProfileReport {
    pub(super) fn new(profile: &Profile, threads: usize, wall_s: f64, cpu_s: f64) -> Self {
        let phases = profile.phases();
        let sum = |value: fn(&PhaseTime) -> f64| phases.iter().map(value).sum::<f64>();
        Self {
            threads,
            other_wall_s: (wall_s - sum(|p| p.wall_s)).max(0.0),
            other_cpu_s: (cpu_s - sum(|p| p.cpu_s)).max(0.0),
            counts: profile.counts,
            units: profile.unit_times(),
            phases,
        }
    }
}

impl fmt::Display for ProfileReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wall: f64 = self.phases.iter().map(|p| p.wall_s).sum::<f64>() + self.other_wall_s;
        let cpu: f64 = self.phases.iter().map(|p| p.cpu_s).sum::<f64>() + self.other_cpu_s;
        let steps = self.counts.steps.max(1) as f64;
        writeln!(
            f,
            "{:<18}{:>9}{:>9}{:>8}{:>12}",
            "phase", "wall s", "CPU s", "CPU %", "CPU ms/step"
        )?;
        let mut row = |name: &str, wall_s: f64, cpu_s: f64| {
            writeln!(
                f,
                "{name:<18}{wall_s:>9.2}{cpu_s:>9.2}{:>8.1}{:>12.2}",
                100.0 * cpu_s / cpu.max(1e-9),
                1e3 * cpu_s / steps
            )
        };
        for phase in &self.phases {
            row(phase.phase.name(), phase.wall_s, phase.cpu_s)?;
        }
        row("other", self.other_wall_s, self.other_cpu_s)?;
        row("total", wall, cpu)?;
        let c = &self.counts;
        let per_view = |count: u64| count as f64 / c.forward_views.max(1) as f64;
        writeln!(
            f,
            "{} steps, {} views ({} differentiated), {:.0} Gaussians and {:.0} pixels per view, {} threads",
            c.steps,
            c.forward_views,
            c.backward_views,
            per_view(c.gaussians),
            per_view(c.pixels),
            self.threads
        )?;
        let u = &self.units;
        let ns = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.2}"));
        writeln!(
            f,
            "CPU ns per Gaussian: project {}, bin {}, chain {}, optimize {}, filter {}",
            ns(u.project_per_gaussian_ns),
            ns(u.bin_per_gaussian_ns),
            ns(u.project_backward_per_gaussian_ns),
            ns(u.optimize_per_gaussian_ns),
            ns(u.filter_per_gaussian_ns)
        )?;
        write!(
            f,
            "CPU ns per visited pair: forward {}, backward {}; per pixel: loss {}; visited/composited {}; seen {}",
            ns(u.forward_per_pair_ns),
            ns(u.backward_per_pair_ns),
            ns(u.loss_per_pixel_ns),
            ns(u.visited_per_composited),
            ns(u.seen_share)
        )
    }
}
