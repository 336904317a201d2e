//! A short fit after a hole was filled, to what the photos still say there.
//!
//! A filling continues colors: it is smooth, and its rim is a seam. Photos show much of what surrounds a hole, and parts of
//! what is open, but under the light of before and with an object in the way. So every photo is brought to the light of
//! after first, and is believed only where nothing stood in the way (`targets`):
//!
//! ```text
//! target = photo * (after / before)         where matter stayed: pixel by pixel
//! target = photo * (<after> / <photo>)      where it was filled: the detail of the photo, the light of the filling
//! target = after                            where no photo is believed, with little weight: what is there stays
//! ```
//!
//! `before` and `after` are the rendered scenes and `<>` is a mean over what is believed nearby. Only the filling and a rim
//! around it are fitted, colors and shapes; everything else keeps its bytes.

mod fit;
mod rows;
mod targets;

use motes_raster::Antialias;
use motes_scene::Gaussians;
use serde::Serialize;
use train_splat::TrainingImage;

use crate::EditState;

/// Present rows that filled holes, and those around them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Fills {
    /// What is new.
    pub filled: Vec<u32>,
    /// What was there, in the plane of a hole and close to it.
    pub rim: Vec<u32>,
}

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefitOptions {
    /// Steps, one view each.
    pub steps: u32,
    /// Key of the order of the views.
    pub seed: u64,
    /// The footprint to draw the Gaussians with.
    pub antialias: Antialias,
}

/// What came of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RefitReport {
    /// Steps that were taken.
    pub steps: u32,
    /// Gaussians that were fitted.
    pub gaussians: usize,
    /// Photos that show them.
    pub views: usize,
    /// Share of the pixels with them in which a photo is believed.
    pub photo_share: f64,
    /// Root mean square difference from those photos under the light of after, before and after the fit, sRGB-encoded.
    pub residual: [f64; 2],
}

/// How it ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Refitted {
    /// It was fitted.
    Done(RefitReport),
    /// There was nothing to go by, and why.
    Skipped(&'static str),
    /// The user asked to stop.
    Stopped,
}

/// Fits fillings and their rims to `photos`, which show the scene before the edit.
pub fn refit(
    state: &mut EditState,
    fills: &Fills,
    photos: &[TrainingImage],
    options: &RefitOptions,
    stopped: &dyn Fn() -> bool,
) -> Refitted {
    let Some(before) = state.sources.first().and_then(|source| source.gaussians.clone()) else {
        return Refitted::Skipped("a plain splat has no light that could be taken out of photos");
    };
    if state.parts.as_ref().is_some_and(|parts| parts.environment_changed) {
        return Refitted::Skipped("the photos are of another light than the scene has now");
    }
    if fills.filled.is_empty() {
        return Refitted::Skipped("nothing was filled");
    }
    let mut rows = [&fills.filled[..], &fills.rim].concat();
    rows.sort_unstable();
    let sights = targets::Sights::new(state, &before, fills, &rows, options.antialias);
    let mut found = Vec::new();
    for photo in photos {
        if stopped() {
            return Refitted::Stopped;
        }
        found.extend(sights.target(photo));
    }
    if !found.iter().any(|target| target.believed > 0) {
        return Refitted::Skipped("no photo shows what was uncovered");
    }
    match fit::fit(&mut state.gaussians, &rows, &found, options, stopped) {
        Some(report) => Refitted::Done(report),
        None => Refitted::Stopped,
    }
}

/// 1 for the rows of a list, 0 for others.
fn marks(gaussians: &Gaussians, rows: impl IntoIterator<Item = u32>) -> Vec<f32> {
    let mut marks = vec![0.0; gaussians.len()];
    rows.into_iter().for_each(|row| marks[row as usize] = 1.0);
    marks
}
