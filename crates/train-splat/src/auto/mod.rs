//! Only what the scene requires: which components of the model are in, decided from evidence.
//!
//! A component is kept when views that a short fit did not see are predicted so much better with
//! it that the gain exceeds what its parameters cost; [`criterion`] has the equations. The probes
//! themselves are in `trainer/probes.rs`, what needs no probe is in [`detail`] and [`rules`].

pub(crate) mod bands;
pub(crate) mod criterion;
pub(crate) mod detail;
pub(crate) mod options;
pub(crate) mod probing;
mod report;
pub(crate) mod rules;

pub use options::{BackgroundModel, ExposureModel, ModelChoice};
use serde::{Deserialize, Serialize};

pub use report::{Candidate, Decision, ProbeCost};

use crate::start::PoseCheck;
use crate::start::options::StartFrom;

impl ExposureModel {
    /// Whether every photo has an exposure of its own.
    pub(crate) fn is_fitted(self) -> bool {
        matches!(self, Self::Gain | Self::Affine)
    }

    /// Free parameters for `views` photos: their mean is fixed.
    pub(crate) fn parameters(self, views: usize) -> usize {
        let per_view = match self {
            Self::Auto | Self::None => 0,
            Self::Gain => 3,
            Self::Affine => 6,
        };
        per_view * views.saturating_sub(1)
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Auto | Self::None => "none",
            Self::Gain => "gain",
            Self::Affine => "affine",
        }
    }
}

impl BackgroundModel {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Color => "color",
            Self::Shell => "shell",
        }
    }
}

/// The components in effect and why: part of the state of a fit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelState {
    /// Whether views are held out for probes.
    pub probing: bool,
    /// Whether the background is decided.
    pub background_decided: bool,
    /// Whether the exposure model is decided.
    pub exposure_decided: bool,
    /// Whether the SH degree is decided.
    pub degree_decided: bool,
    /// SH degree in use.
    pub sh_degree: u8,
    /// Exposure model in use; never `Auto`.
    pub exposure: ExposureModel,
    /// Background model in use.
    pub background: BackgroundModel,
    /// What was decided, in order.
    pub decisions: Vec<Decision>,
    /// Where the first Gaussians came from.
    #[serde(default)]
    pub start: StartState,
}

/// Where the first Gaussians of a fit came from, and what it said about the poses.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StartState {
    /// The start in effect; never `Auto` once a fit has begun.
    pub from: StartFrom,
    /// Starts that came to nothing, in order.
    pub failed: Vec<StartFrom>,
    /// Whether matches agree with the poses, where it was looked at.
    pub poses: Option<PoseCheck>,
    /// How many times the preset's steps this fit takes; 0 in checkpoints that do not say.
    #[serde(default)]
    pub steps_factor: f64,
}
