//! What changes from step to step, and what one step says.

use motes_raster::FrameStats;
use motes_scene::Gaussians;
use serde::Serialize;

use crate::exposure::Exposures;
use crate::loss::LossValue;
use crate::moments::Moments;
use crate::refine::{RefineCounts, RefineStats};

/// Everything that changes from step to step: what a checkpoint holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitState {
    /// Steps done.
    pub step: u32,
    /// The model, without the 3D filter.
    pub gaussians: Gaussians,
    /// Adam's memory.
    pub moments: Moments,
    /// Statistics since the last refinement.
    pub refine_stats: RefineStats,
    /// 3D filter width per Gaussian; empty when off.
    pub filter_3d: Vec<f32>,
    /// Exposure of every photo.
    pub exposures: Exposures,
    /// Whether exposures are fitted; `None`: not decided yet.
    pub exposure_on: Option<bool>,
    /// The measure behind that decision; 0 before it.
    pub gain_spread: f64,
    /// Number of Gaussians at the start, from which the budget curve rises.
    pub initial_gaussians: usize,
}

/// What one step did.
#[derive(Clone, Copy, Debug)]
pub struct StepReport {
    /// Index of the view.
    pub view: usize,
    /// Loss before the update.
    pub loss: LossValue,
    /// Set when this step refined.
    pub refined: Option<RefineCounts>,
}

/// CPU-independent wall times of the phases, seconds, summed over all steps.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PhaseSeconds {
    /// Projection and SH.
    pub project: f64,
    /// Sorting and tile lists.
    pub bin: f64,
    /// Forward kernels.
    pub forward: f64,
    /// Loss and its gradient.
    pub loss: f64,
    /// Backward kernels.
    pub backward: f64,
    /// Chain to the stored parameters.
    pub project_backward: f64,
    /// Adam.
    pub optimise: f64,
    /// Densification, pruning, filter.
    pub refine: f64,
}

impl PhaseSeconds {
    pub(crate) fn add_frame(&mut self, stats: &FrameStats) {
        self.project += stats.project.as_secs_f64();
        self.bin += stats.bin.as_secs_f64();
        self.forward += stats.forward.as_secs_f64();
        self.backward += stats.backward.as_secs_f64();
        self.project_backward += stats.project_backward.as_secs_f64();
    }
}
