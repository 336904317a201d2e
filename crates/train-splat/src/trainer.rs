//! The optimizer loop, one step at a time.
//!
//! The parts: [`construction`] (views, start, resume), [`schedule`] (progress, rates, order and
//! draws), [`budget`] (progress by wall time), [`model`] and [`probes`] (which components are in),
//! [`step`], [`refinement`] and [`finish`] (what carries nothing at the end goes).

mod budget;
mod construction;
mod finish;
mod health;
mod model;
mod probes;
mod refinement;
mod schedule;
mod scoring;
mod step;

use std::sync::Arc;

use motes_raster::{Frame, GaussianGradients, Planes, RasterParameters};
use motes_scene::Gaussians;

use self::budget::Clock;
pub use self::budget::TimeBudget;
use crate::auto::{BackgroundModel, ProbeCost};
use crate::background;
use crate::filter3d;
use crate::loss::PhotometricLoss;
use crate::options::{Background, FitOptions};
use crate::plan::Plan;
use crate::profile::Profile;
use crate::state::FitState;
use crate::target::TrainingView;

/// A fit in progress.
pub struct Trainer {
    options: FitOptions,
    plan: Plan,
    seed: u64,
    views: Arc<Vec<TrainingView>>,
    /// Factors of the gradients by view, 1 for photos; empty where all are photos.
    view_weights: Arc<[f32]>,
    random_background: bool,
    /// The state; a checkpoint is a copy of it.
    pub state: FitState,
    /// Where the time went.
    pub profile: Profile,
    frame: Frame,
    loss: PhotometricLoss,
    gradient_image: Option<Planes>,
    gradients: GaussianGradients,
    /// Sum over the views of a step, when there are several.
    batch: GaussianGradients,
    order: (u64, Vec<u32>),
    clock: Option<Clock>,
    /// Set in a probe: the progress that it stands still at.
    probe: Option<f64>,
    /// What probes took.
    probe_costs: Vec<ProbeCost>,
}

impl Trainer {
    /// The numbers of this run.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Length that learning rates refer to, world units.
    pub fn extent(&self) -> f64 {
        self.state.scene.extent
    }

    /// Counts the work of the kernels from now on, which costs a few percent.
    pub fn count_pairs(&mut self) {
        self.frame.count_pairs = true;
    }

    /// The model as other programs should see it: the 3D filter folded in.
    pub fn model(&self) -> Gaussians {
        let mut gaussians = self.state.gaussians.clone();
        filter3d::bake(&mut gaussians, &self.state.filter_3d);
        if self.state.model.background == BackgroundModel::Color {
            let place = self.state.scene;
            let color = self.state.background.value;
            let dome = background::dome(color, place.shell_center, place.shell_radius);
            background::append(&mut gaussians, &dome);
        }
        gaussians
    }

    /// Parameters of the rasterizer.
    pub fn raster_parameters(&self) -> RasterParameters {
        self.options.raster
    }

    /// Rendering background outside training.
    pub fn background(&self) -> [f32; 3] {
        match self.options.background {
            Background::White => [1.0; 3],
            _ => [0.0; 3],
        }
    }
}
