//! What changes from step to step, and what one step says.

use glam::DVec3;
use motes_scene::Gaussians;

use crate::auto::ModelState;
use crate::background::BackgroundColor;
use crate::exposure::Exposures;
use crate::loss::LossValue;
use crate::moments::Moments;
use crate::refine::{RefineCounts, RefineStats};
use crate::skip::SkipState;

/// How large the scene is: decided by the start, which a resumed fit does not see.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScenePlace {
    /// Length that learning rates and size limits refer to, world units.
    pub extent: f64,
    /// Center of the far shell, were there one, world units.
    pub shell_center: DVec3,
    /// Its radius, world units.
    pub shell_radius: f64,
}

/// Everything that changes from step to step, and what the start decided: what a checkpoint holds.
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
    /// The components in effect and why.
    pub model: ModelState,
    /// The color behind everything, when there is one.
    pub background: BackgroundColor,
    /// Spread of the photos' log gains; 0 before it was measured.
    pub gain_spread: f64,
    /// Which views may go without a backward pass.
    pub skip: SkipState,
    /// Number of Gaussians at the start, from which the budget curve rises.
    pub initial_gaussians: usize,
    /// How large the scene is.
    pub scene: ScenePlace,
}

/// What one step did.
#[derive(Clone, Copy, Debug)]
pub struct StepReport {
    /// Index of the (last) view.
    pub view: usize,
    /// Loss before the update, of that view.
    pub loss: LossValue,
    /// Pixels rendered.
    pub pixels: u64,
    /// Set when this step refined.
    pub refined: Option<RefineCounts>,
}
