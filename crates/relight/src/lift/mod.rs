//! Views that were relit by other means (an image model, a person), lifted back to 3D.
//!
//! Such views disagree: each was made without the others. What is asked of them is the light, which is
//! smooth, and a majority.
//!
//! - [`LiftMethod::Bake`]: the ratio of relit to rendered view, low-passed in log space, is voted on by all views
//!   per Gaussian and multiplied onto its color. Texture stays that of the capture.
//! - [`LiftMethod::Refit`]: the same first, then the harmonics of the colors are fitted to the relit views
//!   with a robust loss. Texture may change.
//!
//! Both estimate a gain per view and channel and a weight per view from the votes ([`ViewAgreement`]).

mod apply;
mod consensus;
mod options;
mod ratio;
mod refit;
mod votes;

use motes_raster::Antialias;
use motes_scene::{Gaussians, ImageF32, Pinhole, Pose};
pub use options::{Agreement, LiftMethod, LiftOptions};
use serde::Serialize;

use apply::apply;
use consensus::consensus;
use refit::refit;
use votes::votes_of;

/// A relit view.
#[derive(Clone, Debug)]
pub struct RelitView {
    /// Name of the view.
    pub name: String,
    /// Intrinsics at the size of the picture.
    pub camera: Pinhole,
    /// Pose.
    pub camera_from_world: Pose,
    /// `[h, w, 3]`, sRGB-encoded, 0 to 1.
    pub picture: ImageF32,
    /// `[h, w, 1]`, 0 = ignore.
    pub mask: Option<ImageF32>,
}

/// How a view stands to the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ViewAgreement {
    /// Name of the view.
    pub name: String,
    /// Brightness against the others, per channel; it was divided out.
    pub gain_rgb: [f32; 3],
    /// Median deviation from the others after that, stops.
    pub disagreement_stops: f32,
    /// Weight of the view, 0 to 1.
    pub weight: f32,
}

/// The result.
#[derive(Clone, Debug)]
pub struct Lifted {
    /// The same Gaussians with other colors.
    pub gaussians: Gaussians,
    /// One per view, in their order.
    pub views: Vec<ViewAgreement>,
    /// Gaussians that no view saw; they took the median change of the others.
    pub unseen: usize,
    /// Root mean square error of the views before and after, sRGB-encoded, robustly weighted; of a
    /// refit.
    pub refit_rms: Option<[f64; 2]>,
}

/// Lifts `views` onto `gaussians`. The same at any number of threads.
///
/// Without views the Gaussians come back unchanged.
pub fn lift(
    gaussians: &Gaussians,
    antialias: Antialias,
    views: &[RelitView],
    options: &LiftOptions,
) -> Lifted {
    let votes: Vec<_> = views
        .iter()
        .map(|view| votes_of(gaussians, antialias, view, options.lift_radius))
        .collect();
    let agreed = consensus(&votes, options.agreement, gaussians.len());
    let mut lifted = apply(gaussians, &agreed.ratio);
    let agreement = |(view, v): (&RelitView, &consensus::OfView)| ViewAgreement {
        name: view.name.clone(),
        gain_rgb: v.gain.map(f32::exp),
        disagreement_stops: v.deviation / std::f32::consts::LN_2,
        weight: v.weight,
    };
    let refit_rms = (options.lift == LiftMethod::Refit && !views.is_empty())
        .then(|| refit(&mut lifted, antialias, views, &agreed.views, options));
    Lifted {
        gaussians: lifted,
        views: views.iter().zip(&agreed.views).map(agreement).collect(),
        unseen: agreed.unseen,
        refit_rms,
    }
}
