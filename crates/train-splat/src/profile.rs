//! Where the time of a run goes: wall and CPU seconds per phase, and what was done in them.

use std::time::Instant;

use motes_raster::FrameStats;
use serde::Serialize;

use crate::clock::cpu_seconds;

/// A stretch of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Reading the capture and decoding photos.
    Load,
    /// The first Gaussians.
    Init,
    /// Photos at the resolutions of the schedule.
    Resample,
    /// Projection and SH.
    Project,
    /// Sorting and tile lists.
    Bin,
    /// Forward kernels.
    Forward,
    /// Loss and its gradient.
    Loss,
    /// Backward kernels.
    Backward,
    /// Chain to the stored parameters.
    ProjectBackward,
    /// Adam and the priors.
    #[serde(rename = "optimise")]
    Optimize,
    /// Densification and pruning.
    Refine,
    /// The 3D filter.
    Filter,
    /// Held-out scores on the way.
    Evaluate,
    /// Checkpoints and the product.
    Write,
    /// Scores of the finished model.
    Score,
}

/// All phases, in the order of a run.
pub const PHASES: [Phase; 15] = [
    Phase::Load,
    Phase::Init,
    Phase::Resample,
    Phase::Project,
    Phase::Bin,
    Phase::Forward,
    Phase::Loss,
    Phase::Backward,
    Phase::ProjectBackward,
    Phase::Optimize,
    Phase::Refine,
    Phase::Filter,
    Phase::Evaluate,
    Phase::Write,
    Phase::Score,
];

impl Phase {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Load => "load",
            Self::Init => "init",
            Self::Resample => "resample",
            Self::Project => "project",
            Self::Bin => "bin",
            Self::Forward => "forward",
            Self::Loss => "loss",
            Self::Backward => "backward",
            Self::ProjectBackward => "project_backward",
            // Reports keep the spelling of their first version.
            Self::Optimize => "optimise",
            Self::Refine => "refine",
            Self::Filter => "filter",
            Self::Evaluate => "evaluate",
            Self::Write => "write",
            Self::Score => "score",
        }
    }
}

/// A moment, in wall and in CPU time of all threads of the process.
#[derive(Clone, Copy, Debug)]
pub struct Lap {
    wall: Instant,
    cpu: f64,
}

impl Lap {
    /// Now.
    pub fn start() -> Self {
        Self { wall: Instant::now(), cpu: cpu_seconds() }
    }

    /// Wall and CPU seconds since.
    pub fn elapsed(&self) -> [f64; 2] {
        [self.wall.elapsed().as_secs_f64(), cpu_seconds() - self.cpu]
    }
}

/// What was done, summed over all steps; the units of the times per unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct WorkCounts {
    /// Optimizer steps.
    pub steps: u64,
    /// Views rendered for a step.
    pub forward_views: u64,
    /// Of those, the ones that were differentiated.
    pub backward_views: u64,
    /// Gaussians, summed over views.
    pub gaussians: u64,
    /// Of those, the ones on the image (views that were differentiated).
    pub gaussians_seen: u64,
    /// Pixels, summed over views.
    pub pixels: u64,
    /// (pixel, Gaussian) pairs evaluated in forward passes; 0 unless counting was asked for.
    pub pairs_visited: u64,
    /// Pairs that changed a pixel; 0 unless counting was asked for.
    pub pairs_composited: u64,
    /// Refinements.
    pub refinements: u64,
    /// Gaussians, summed over updates of the 3D filter.
    pub filtered_gaussians: u64,
}

/// Times and counts of a run so far.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    wall: [f64; PHASES.len()],
    cpu: [f64; PHASES.len()],
    /// What was done.
    pub counts: WorkCounts,
}

/// One line of the table.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PhaseTime {
    /// Which phase.
    pub phase: Phase,
    /// Wall seconds.
    pub wall_s: f64,
    /// CPU seconds of all threads. Inside one call of the rasterizer they are shared out by wall time.
    pub cpu_s: f64,
}

/// CPU nanoseconds per unit of work; `None` where nothing was counted.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct UnitTimes {
    /// Projection per Gaussian and view.
    pub project_per_gaussian_ns: Option<f64>,
    /// Sorting and listing per Gaussian and view.
    pub bin_per_gaussian_ns: Option<f64>,
    /// Forward kernels per visited pair.
    pub forward_per_pair_ns: Option<f64>,
    /// Backward kernels per visited pair (pairs are counted in the forward pass).
    pub backward_per_pair_ns: Option<f64>,
    /// Loss per pixel of three channels.
    pub loss_per_pixel_ns: Option<f64>,
    /// Chain per Gaussian and view.
    pub project_backward_per_gaussian_ns: Option<f64>,
    /// Adam per Gaussian and step.
    #[serde(rename = "optimise_per_gaussian_ns")]
    pub optimize_per_gaussian_ns: Option<f64>,
    /// 3D filter per Gaussian and update.
    pub filter_per_gaussian_ns: Option<f64>,
    /// Visited over composited pairs.
    pub visited_per_composited: Option<f64>,
    /// Share of the Gaussians that a differentiated view sees.
    pub seen_share: Option<f64>,
}

impl Profile {
    /// Adds the time since `lap` to a phase.
    pub fn add(&mut self, phase: Phase, lap: Lap) {
        self.add_seconds(phase, lap.elapsed());
    }

    /// Adds wall and CPU seconds to a phase.
    pub fn add_seconds(&mut self, phase: Phase, [wall, cpu]: [f64; 2]) {
        self.wall[phase as usize] += wall;
        self.cpu[phase as usize] += cpu;
    }

    /// Wall seconds of a phase.
    pub fn wall_s(&self, phase: Phase) -> f64 {
        self.wall[phase as usize]
    }

    /// CPU seconds of a phase.
    pub fn cpu_s(&self, phase: Phase) -> f64 {
        self.cpu[phase as usize]
    }

    /// Shares a call's CPU time out by the wall time of its phases.
    fn share_out(&mut self, cpu: f64, parts: &[(Phase, f64)]) {
        let whole: f64 = parts.iter().map(|(_, wall)| wall).sum();
        for &(phase, wall) in parts {
            self.add_seconds(phase, [wall, cpu * wall / whole.max(1e-12)]);
        }
    }

    /// Adds a forward call that began at `lap`, without the `since` seconds after it.
    pub(crate) fn add_forward(
        &mut self,
        lap: Lap,
        since: [f64; 2],
        stats: &FrameStats,
        size: [usize; 2],
        n: usize,
    ) {
        let seconds = [stats.project, stats.bin, stats.forward].map(|d| d.as_secs_f64());
        let phases = [Phase::Project, Phase::Bin, Phase::Forward];
        let parts: Vec<_> = phases.into_iter().zip(seconds).collect();
        self.share_out((lap.elapsed()[1] - since[1]).max(0.0), &parts);
        let counts = &mut self.counts;
        counts.forward_views += 1;
        counts.gaussians += n as u64;
        counts.pixels += (size[0] * size[1]) as u64;
        counts.pairs_visited += stats.pairs_visited;
        counts.pairs_composited += stats.pairs_composited;
    }

    pub(crate) fn add_backward(&mut self, lap: Lap, stats: &FrameStats) {
        let chain = stats.project_backward.as_secs_f64();
        let parts =
            [(Phase::Backward, stats.backward.as_secs_f64()), (Phase::ProjectBackward, chain)];
        self.share_out(lap.elapsed()[1], &parts);
        self.counts.backward_views += 1;
    }

    /// All phases that took time.
    pub fn phases(&self) -> Vec<PhaseTime> {
        let time = |phase: Phase| PhaseTime {
            phase,
            wall_s: self.wall_s(phase),
            cpu_s: self.cpu_s(phase),
        };
        PHASES.into_iter().map(time).filter(|t| t.wall_s > 0.0).collect()
    }

    /// CPU nanoseconds per unit of work.
    pub fn unit_times(&self) -> UnitTimes {
        let c = &self.counts;
        let ratio = |a: f64, b: u64| (b > 0).then(|| a / b as f64);
        let per = |phase, count| ratio(self.cpu_s(phase) * 1e9, count);
        // What was not differentiated took no backward time.
        let differentiated = |count: u64| count * c.backward_views / c.forward_views.max(1);
        UnitTimes {
            project_per_gaussian_ns: per(Phase::Project, c.gaussians),
            bin_per_gaussian_ns: per(Phase::Bin, c.gaussians),
            forward_per_pair_ns: per(Phase::Forward, c.pairs_visited),
            backward_per_pair_ns: per(Phase::Backward, differentiated(c.pairs_visited)),
            loss_per_pixel_ns: per(Phase::Loss, c.pixels),
            project_backward_per_gaussian_ns: per(
                Phase::ProjectBackward,
                differentiated(c.gaussians),
            ),
            optimize_per_gaussian_ns: per(
                Phase::Optimize,
                c.gaussians * c.steps / c.forward_views.max(1),
            ),
            filter_per_gaussian_ns: per(Phase::Filter, c.filtered_gaussians),
            visited_per_composited: ratio(c.pairs_visited as f64, c.pairs_composited),
            seen_share: ratio(c.gaussians_seen as f64, differentiated(c.gaussians)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn phases_are_listed_at_their_own_index() {
        for (i, phase) in PHASES.into_iter().enumerate() {
            assert_eq!(phase as usize, i, "{}", phase.name());
        }
    }

    #[test]
    fn work_takes_wall_and_cpu_time_and_calls_are_shared_out() {
        let lap = Lap::start();
        let mut x = 1.0f64;
        while lap.elapsed()[0] < 0.05 {
            x = std::hint::black_box(x * 1.000_001);
        }
        let stats = FrameStats {
            project: Duration::from_millis(10),
            bin: Duration::from_millis(10),
            forward: Duration::from_millis(20),
            ..FrameStats::default()
        };
        let mut profile = Profile::default();
        profile.add_forward(lap, [0.0; 2], &stats, [8, 4], 7);
        let cpu = profile.cpu_s(Phase::Forward);
        assert!(cpu > 0.0 && (cpu - 2.0 * profile.cpu_s(Phase::Bin)).abs() < 1e-9);
        assert_eq!(profile.wall_s(Phase::Forward), 0.02);
        assert_eq!((profile.counts.pixels, profile.counts.gaussians), (32, 7));
        let units = profile.unit_times();
        assert!(units.forward_per_pair_ns.is_none() && units.bin_per_gaussian_ns.unwrap() > 0.0);
    }
}
