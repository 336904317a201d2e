//! How a fit begins: views at every resolution, the first Gaussians, or a checkpoint.

use std::sync::Arc;

use motes_raster::{Frame, GaussianGradients};
use motes_scene::{Gaussians, SparsePoints};

use super::Trainer;
use crate::auto::ModelState;
use crate::background::{self, BackgroundColor};
use crate::error::FitError;
use crate::exposure::Exposures;
use crate::init;
use crate::loss::PhotometricLoss;
use crate::moments::Moments;
use crate::options::AlphaMode;
use crate::options::{Background, FitOptions};
use crate::plan::Plan;
use crate::profile::{Lap, Phase, Profile};
use crate::refine::RefineStats;
use crate::skip::SkipState;
use crate::start::{self, Start, StartFrom};
use crate::state::{FitState, ScenePlace};
use crate::target::{TrainingImage, TrainingView};

/// Keeps at most `most` rows, evenly spread and not the first ones: points often come in spatial
/// order.
fn thin_out(gaussians: &mut Gaussians, most: usize) {
    let n = gaussians.len();
    if n > most {
        let rows: Vec<u32> =
            (0..most).map(|i| (i as u64 * n as u64 / most as u64) as u32).collect();
        gaussians.gather(&rows);
    }
}

impl Trainer {
    /// Prepares a fit of `images`, starting from `start` or else from `points`.
    pub fn new(
        images: &[TrainingImage],
        points: &SparsePoints,
        start: Option<Gaussians>,
        options: &FitOptions,
        seed: u64,
    ) -> Result<Self, FitError> {
        Self::starting_from(images, points, start, &[], options, seed)
    }

    /// The same after fits that began with `failed` came to nothing.
    pub fn starting_from(
        images: &[TrainingImage],
        points: &SparsePoints,
        start: Option<Gaussians>,
        failed: &[StartFrom],
        options: &FitOptions,
        seed: u64,
    ) -> Result<Self, FitError> {
        if images.is_empty() {
            return Err(FitError::NoViews);
        }
        let lap = Lap::start();
        let mut plan = Plan::new(options, images.len())?;
        let mut model = ModelState::new(options, &mut plan, images, start.as_ref());
        let from = options.start.following(failed, points.len());
        model.start.failed = failed.to_vec();
        let is_new = start.is_none();
        let start = match start {
            Some(given) => Start::given(given, points),
            None => start::first_gaussians(images, points, from, &plan, options, seed),
        };
        model.note_start(from, &start);
        model.plan_steps(&mut plan, images, &start.gaussians.means, is_new);
        let Start { mut gaussians, points, .. } = start;
        let poses = images.iter().map(|image| &image.camera_from_world);
        let extent = init::scene_extent(poses, &points.positions);
        gaussians = gaussians.with_sh_degree(plan.sh_degree);
        thin_out(&mut gaussians, plan.max_gaussians);
        let scales: Vec<f64> = plan.stages.iter().map(|s| s.scale).collect();
        let views: Vec<TrainingView> = images
            .iter()
            .map(|image| TrainingView::new(image, &scales, options.alpha_mode))
            .collect();
        let (shell_center, shell_radius) = background::place(&views, &points, extent);
        let has_alpha = options.alpha_mode == AlphaMode::Transparent
            && images.iter().any(|image| image.image.channels == 4);
        let random_background = match options.background {
            Background::Auto => has_alpha,
            Background::Random => true,
            Background::Black | Background::White => false,
        };
        let state = FitState {
            step: 0,
            moments: Moments::zeros(&gaussians),
            refine_stats: RefineStats::zeros(gaussians.len()),
            filter_3d: Vec::new(),
            exposures: Exposures::identity(images.len()),
            model,
            background: BackgroundColor::default(),
            gain_spread: 0.0,
            skip: SkipState::new(images.len()),
            initial_gaussians: gaussians.len(),
            scene: ScenePlace { extent, shell_center, shell_radius },
            gaussians,
        };
        let mut trainer = Self {
            options: options.clone(),
            plan,
            seed,
            views: Arc::new(views),
            view_weights: Arc::new([]),
            random_background,
            state,
            profile: Profile::default(),
            frame: Frame::new(),
            loss: PhotometricLoss::new(),
            gradient_image: None,
            gradients: GaussianGradients::default(),
            batch: GaussianGradients::default(),
            order: (u64::MAX, Vec::new()),
            clock: None,
            probe: None,
            probe_costs: Vec::new(),
        };
        trainer.start_model();
        trainer.profile.add(Phase::Init, lap);
        trainer.update_filter();
        Ok(trainer)
    }

    /// Adds views that are no photos; their gradients count by the factors `weights`, 0 to 1. What the photos decided stays.
    pub fn add_views(&mut self, images: &[TrainingImage], weights: &[f32]) {
        assert_eq!(images.len(), weights.len(), "a weight per view");
        assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)), "weights {weights:?}");
        if images.is_empty() {
            return;
        }
        let photos = self.views.len();
        let scales: Vec<f64> = self.plan.stages.iter().map(|s| s.scale).collect();
        let mode = self.options.alpha_mode;
        let more = images.iter().map(|image| TrainingView::new(image, &scales, mode));
        Arc::make_mut(&mut self.views).extend(more);
        self.view_weights = [&vec![1.0; photos][..], weights].concat().into();
        self.state.exposures.extend(images.len());
        self.state.skip.baseline.resize(photos + images.len(), 0.0);
        self.update_filter();
    }

    /// Continues from a checkpoint of the same capture, options and seed.
    pub fn resume(
        images: &[TrainingImage],
        points: &SparsePoints,
        state: FitState,
        options: &FitOptions,
        seed: u64,
    ) -> Result<Self, FitError> {
        if state.exposures.values.len() != images.len() {
            let (was, is) = (state.exposures.values.len(), images.len());
            let text = format!("it was made with {was} training views, there are {is}");
            return Err(FitError::Checkpoint(text));
        }
        let mut trainer = Self::new(images, points, Some(state.gaussians.clone()), options, seed)?;
        if state.model.sh_degree != state.gaussians.sh_degree {
            return Err(FitError::Checkpoint("its SH degree differs".into()));
        }
        trainer.plan.sh_degree = state.model.sh_degree;
        trainer.plan.lengthen(state.model.start.steps_factor);
        trainer.state = state;
        Ok(trainer)
    }
}
