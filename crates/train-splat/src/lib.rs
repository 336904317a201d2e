//! Fitting Gaussians to a capture: losses, schedules, densification, the optimizer loop.
//!
//! [`Trainer`] holds a fit in progress; [`FitState`] is all of it that changes, so a copy is a
//! checkpoint. Random numbers are keyed by (seed, purpose, step), never drawn from a running
//! generator, and every sum has a fixed order: the result depends on the seed alone.

mod auto;
mod background;
mod clock;
mod dense;
mod error;
mod exposure;
pub mod files;
mod filter3d;
mod front;
mod gaps;
mod init;
pub mod loss;
mod moments;
mod options;
mod photo_order;
mod plan;
mod priors;
mod profile;
mod refine;
mod skip;
mod start;
mod state;
mod target;
mod trainer;
mod visits;
mod watch;

pub use auto::{
    BackgroundModel, Candidate, Decision, ExposureModel, ModelChoice, ModelState, ProbeCost,
    StartState,
};
pub use background::BackgroundColor;
pub use dense::dense_points;
pub use error::FitError;
pub use exposure::Exposures;
pub use front::Stage;
pub use gaps::{Between, between_photos};
pub use init::scene_extent;
pub use moments::{MomentColumns, Moments, Rates, Update};
pub use options::{AdamRule, AlphaMode, Background, Densify, FitOptions, FreezeGroup, Preset};
pub use photo_order::PhotoOrder;
pub use plan::Plan;
pub use profile::{Lap, PHASES, Phase, PhaseTime, Profile, UnitTimes, WorkCounts};
pub use refine::{RefineCounts, RefineStats};
pub use skip::SkipState;
pub use start::{PoseCheck, StartFrom};
pub use state::{FitState, ScenePlace, StepReport};
pub use target::{LazyTarget, Target, TrainingImage, TrainingView};
pub use trainer::{TimeBudget, Trainer};
pub use watch::{Baseline, Failure, Health, LONG_RUN, SHORTEST_RUN};
