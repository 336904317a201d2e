//! What a fit starts from: photos, options, and a checkpoint or a model when there is one.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::{
    FitError, FitOptions, FitState, Lap, Phase, Plan, StartFrom, TimeBudget, Trainer, TrainingImage,
};
use motes_codecs::read_gaussians;
use motes_formats::capture::read_capture;
use motes_scene::{
    Capture, ExposureResponse, Gaussians, Pose, SparsePoints, Split, Switch, UnitWorld, View,
};
use motes_stage::{Context, StageError};

use super::checkpoint::read_checkpoint;
use super::photos::{load_training_images, sha256_of};
use super::pseudo::PseudoViews;
use super::resumed::agrees;
use super::world::{into_unit, points_into_unit, unit_world};

/// Reads a time budget.
///
/// # Errors
/// A sentence for the user.
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(seconds),
        _ => Err("expected seconds above 0".into()),
    }
}

/// Spans of the cameras, world units, whose Gaussians single precision holds with their squares.
const SPANS: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// Refuses a world whose Gaussians a PLY cannot hold.
fn check_span(world: &UnitWorld, capture: &Path) -> Result<(), StageError> {
    if SPANS.contains(&world.length) {
        return Ok(());
    }
    let text = format!(
        "the cameras span {:.0e} units: Gaussians of that size have no place in the single \
         precision of a PLY: {}",
        world.length,
        capture.display()
    );
    let remedy = "scale poses and points so that the cameras span 1e-9 to 1e9 units";
    Err(StageError::bad_input(text).help(remedy))
}

/// What the command line asks for.
pub struct StartRequest<'a> {
    /// Capture document.
    pub capture: &'a Path,
    /// Model to start from at step 0.
    pub init_ply: Option<&'a Path>,
    /// Checkpoint to continue.
    pub resume: Option<&'a Path>,
    /// Options of the command line; a checkpoint brings its own.
    pub options: FitOptions,
    /// Seed of the command line; a checkpoint brings its own.
    pub seed: u64,
    /// Wall seconds instead of steps, from the start of the program to its end.
    pub time_budget: Option<f64>,
    /// Whether held-out photos are needed to decide when to stop.
    pub needs_held_out: bool,
}

/// Everything loaded and checked.
pub struct Start {
    /// Photos to fit to; their poses are those of the unit world.
    pub train: Vec<TrainingImage>,
    /// Photos to measure on, likewise.
    pub held_out: Vec<TrainingImage>,
    /// The world of the capture.
    pub world: UnitWorld,
    /// `camera_from_world` of the photos to fit to, and of those to measure on.
    pub world_poses: [Vec<Pose>; 2],
    /// Whether those are training photos, because the capture has no test photos.
    pub set_aside: bool,
    /// Options in effect.
    pub options: FitOptions,
    /// Seed in effect.
    pub seed: u64,
    /// SHA-256 of the capture document.
    pub capture_sha256: String,
    /// How the photos' brightness follows their metadata, where the fit uses it.
    pub exposure_response: Option<ExposureResponse>,
    /// Views of the fit that are no photos.
    pub(super) pseudo: PseudoViews,
    points: SparsePoints,
    /// In the unit world.
    pub(super) model: Option<Gaussians>,
    state: Option<FitState>,
    /// When a time budget ends.
    pub(super) end: Option<Instant>,
    load_seconds: [f64; 2],
}

impl StartRequest<'_> {
    /// Reads everything.
    ///
    /// # Errors
    /// When a file is missing or bad, or the checkpoint belongs to another capture.
    pub fn load(self, context: &Context) -> anyhow::Result<Start> {
        let lap = Lap::start();
        let end = self.time_budget.map(|seconds| {
            let left = (seconds - context.elapsed_seconds()).clamp(0.0, 1e9);
            Instant::now() + Duration::from_secs_f64(left)
        });
        context.input("capture", self.capture)?;
        let mut capture = read_capture(self.capture)?;
        self.check_memory(&capture, context)?;
        let load = |split| load_training_images(self.capture, &capture, &capture.views_of(split));
        let (mut train, mut held_out) = (load(Split::Train)?, load(Split::Test)?);
        let set_aside = self.needs_held_out && held_out.is_empty();
        if set_aside {
            (train, held_out) = set_photos_aside(train)?;
            context.warn(format!(
                "the capture has no test photos: {} of its {} training photos are set aside for --target",
                held_out.len(),
                held_out.len() + train.len()
            ));
        }
        let capture_sha256 = sha256_of(self.capture)?;
        let (mut options, mut seed, mut state, mut model) = (self.options, self.seed, None, None);
        if let Some(path) = self.resume {
            context.input("resume", path)?;
            let checkpoint = read_checkpoint(path)?;
            if checkpoint.capture_sha256 != capture_sha256 {
                let text = format!("the checkpoint belongs to another capture: {}", path.display());
                let remedy = "use --init-ply to start from its model";
                return Err(StageError::bad_input(text).help(remedy).into());
            }
            agrees(&options, seed, &checkpoint, path)?;
            (options, seed) = (checkpoint.options, checkpoint.seed);
            state = Some(checkpoint.state);
        }
        if let Some(path) = self.init_ply {
            context.input("init-ply", path)?;
            model = Some(read_gaussians(path)?);
        }
        match options.exposure_metadata {
            Switch::Off => {
                capture.exposure_response = None;
                train.iter_mut().chain(&mut held_out).for_each(|image| image.exposure_gain = 1.0);
            }
            Switch::On if capture.exposure_response.is_none() => {
                let text = "--exposure-metadata on: the capture has no exposure response";
                let remedy = "import photos with EXIF data whose brightness follows it";
                return Err(StageError::usage(text).help(remedy).into());
            }
            _ => {}
        }
        let world = unit_world(&capture, &options);
        check_span(&world, self.capture)?;
        let world_poses = [into_unit(&world, &mut train), into_unit(&world, &mut held_out)];
        let mut points = capture.points;
        points_into_unit(&world, &mut points);
        let model = model.map(|model| world.gaussians(model));
        Ok(Start {
            exposure_response: capture.exposure_response,
            train,
            held_out,
            world,
            world_poses,
            set_aside,
            options,
            seed,
            capture_sha256,
            pseudo: PseudoViews::default(),
            points,
            model,
            state,
            end,
            load_seconds: lap.elapsed(),
        })
    }
}

impl StartRequest<'_> {
    /// Says now what the system would say by killing the run later.
    fn check_memory(&self, capture: &Capture, context: &Context) -> anyhow::Result<()> {
        let views = capture.views_of(Split::Train).len();
        let plan = Plan::new(&self.options, views).map_err(to_stage)?;
        let camera = |view: &View| &capture.cameras[view.camera];
        let pixels: Vec<u64> =
            capture.views.iter().map(camera).map(|c| (c.width * c.height) as u64).collect();
        let remedy = "import with a smaller --max-resolution, or lower --max-gaussians";
        Ok(context.need_memory(plan.memory_bytes(&pixels), remedy)?)
    }
}

impl Start {
    /// The numbers that preset, flags and number of photos come to.
    ///
    /// # Errors
    /// When an option cannot be used.
    pub fn plan(&self) -> anyhow::Result<Plan> {
        Ok(Plan::new(&self.options, self.train.len()).map_err(to_stage)?)
    }

    /// The fit, ready for its first step.
    ///
    /// # Errors
    /// When an option cannot be used, there is no training photo, or the checkpoint does not fit.
    pub fn trainer(&self) -> anyhow::Result<Trainer> {
        let (options, seed) = (&self.options, self.seed);
        let trainer = match self.state.clone() {
            Some(state) => Trainer::resume(&self.train, &self.points, state, options, seed),
            None => Trainer::new(&self.train, &self.points, self.model.clone(), options, seed),
        };
        let mut trainer = trainer.map_err(to_stage)?;
        trainer.add_views(&self.pseudo.images, &self.pseudo.weights);
        trainer.profile.add_seconds(Phase::Load, self.load_seconds);
        if let Some(end) = self.end {
            let scored_views = self.train.len() + self.held_out.len();
            trainer.set_time_budget(&TimeBudget { end, scored_views }).map_err(to_stage)?;
        }
        Ok(trainer)
    }
}

impl Start {
    /// A fit of the same photos after those that began with `failed` came to nothing.
    pub(super) fn another_trainer(&self, failed: &[StartFrom]) -> anyhow::Result<Trainer> {
        let (options, seed) = (&self.options, self.seed);
        let trainer =
            Trainer::starting_from(&self.train, &self.points, None, failed, options, seed);
        let mut trainer = trainer.map_err(to_stage)?;
        trainer.add_views(&self.pseudo.images, &self.pseudo.weights);
        Ok(trainer)
    }
}

/// One photo in so many is set aside.
const SET_ASIDE_EVERY: usize = 8;
/// With fewer photos none can be spared.
const FEWEST_PHOTOS: usize = 3;

/// Training photos, and every eighth of them (at least one) to measure on.
fn set_photos_aside(
    photos: Vec<TrainingImage>,
) -> anyhow::Result<(Vec<TrainingImage>, Vec<TrainingImage>)> {
    let count = photos.len();
    if count < FEWEST_PHOTOS {
        let text = format!("--target needs photos to measure on, and there are only {count}");
        return Err(StageError::usage(text).help("give --iterations instead").into());
    }
    let every = SET_ASIDE_EVERY.min(count);
    let (aside, rest): (Vec<_>, Vec<_>) =
        photos.into_iter().enumerate().partition(|(i, _)| i % every == every / 2);
    let plain = |photos: Vec<(usize, TrainingImage)>| photos.into_iter().map(|(_, p)| p).collect();
    Ok((plain(rest), plain(aside)))
}

/// The exit code that each kind of error stands for.
fn to_stage(error: FitError) -> StageError {
    let text = error.to_string();
    match error {
        FitError::Option { .. } => StageError::usage(text),
        FitError::NoViews => StageError::bad_input(text)
            .help("import with --test-every or --test-list so that some views stay for training"),
        FitError::Checkpoint(_) => StageError::bad_input(text),
    }
}
