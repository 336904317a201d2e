//! Structure from motion: camera poses from photos, by running COLMAP as a child process.
//!
//! Two ways to run it: `pycolmap` (a Python driver that ships inside this program) and the
//! `colmap` command. A child process, so that a crash inside COLMAP is an error message here.

mod choose;
mod colmap_command;
mod colmap_step;
mod events;
mod heif_photos;
mod judge;
mod options;
mod pycolmap;
mod runs;
mod staged_photos;
mod triangulate;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub(crate) use judge::failure;
pub use options::{CameraSharing, Keypoints, Matcher, SfmOptions, SfmTool};
pub(crate) use triangulate::triangulate;

use crate::error::Result;
use crate::files::from_colmap;
use crate::gathered::Gathered;
use crate::progress::Progress;

/// How poses were found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SfmReport {
    /// Program and version.
    pub tool: String,
    /// Focal length that the solver was told, pixels.
    pub focal_prior_px: Option<f64>,
    /// `flag`, `exif`, `guess` (1.2 times the long side) or `none`.
    pub focal_prior_source: String,
    /// Focal length that it ended at, pixels, of the camera with the most photos.
    pub focal_px: f64,
    /// COLMAP's mean reprojection error, pixels.
    pub mean_reprojection_error_px: Option<f64>,
    /// Pairs of photos that were found to show the same thing.
    pub verified_pairs: Option<u64>,
    /// Wall-clock seconds of all runs.
    pub seconds: f64,
    /// One sentence for each run when there was more than one, in order; the last sentence says which was kept.
    pub attempts: Vec<String>,
}

/// What one run of a tool delivers.
#[derive(Clone, Debug, Default)]
struct Solution {
    /// Model folders, the one with the most photos first.
    models: Vec<PathBuf>,
    /// Photos in the first model.
    registered: usize,
    /// Photos that were given.
    photos: usize,
    /// Whether faint keypoints were matched, too.
    faint: bool,
    /// Photos that were placed against what their matches say, and have no pose for it.
    contradicted: usize,
    /// Keypoints per photo, where the tool says so.
    keypoints: Option<f64>,
    report: SfmReport,
    /// Long side of the photos of the main camera, pixels.
    long_side: f64,
    median_parallax_degrees: Option<f64>,
    /// Sentences about single photos.
    warnings: Vec<String>,
}

/// One request to a tool.
struct Request<'a> {
    photos: &'a Path,
    workspace: &'a Path,
    /// What goes with this process, however it ends.
    scratch: Option<&'a Path>,
    masks: Option<&'a Path>,
    options: &'a SfmOptions,
    focal_prior: FocalPrior,
    /// Whether faint keypoints are matched, too.
    faint: bool,
    threads: usize,
}

/// What the solver is told about the focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
enum FocalPrior {
    /// From EXIF where the photos have it.
    Exif,
    /// This many pixels.
    Pixels(f64),
    /// This many pixels, which nobody said.
    Guess(f64),
}

/// Finds poses for the photos in a folder and gathers them as a source. `workspace` is a folder
/// for the database and the models, `is_scratch` when it is to go with this process.
pub(crate) fn gather(
    photos: &Path,
    workspace: &Path,
    is_scratch: bool,
    masks: Option<&Path>,
    options: &SfmOptions,
    progress: &dyn Progress,
) -> Result<(Gathered, SfmReport)> {
    let tool = choose::tool(options)?;
    let staged = staged_photos::stage(photos, workspace, progress)?;
    let request = Request {
        photos: &staged.folder,
        workspace,
        scratch: is_scratch.then_some(workspace),
        masks,
        options,
        focal_prior: options.focal.map_or(FocalPrior::Exif, FocalPrior::Pixels),
        faint: false,
        threads: rayon::current_num_threads(),
    };
    let solution = runs::best(&tool, request, progress)?;
    let mut gathered = from_colmap::gather(&solution.models, photos)?;
    gathered.photos_offered = solution.photos;
    gathered.description = format!("structure from motion with {}", solution.report.tool);
    for photo in &mut gathered.photos {
        photo.upright = staged.turned.contains(&photo.name);
    }
    if !staged.turned.is_empty() {
        gathered.notes.push(format!(
            "{} photos were turned upright by their EXIF orientation",
            staged.turned.len()
        ));
    }
    gathered.notes.extend(solution.report.attempts.iter().cloned());
    gathered.warnings.extend(solution.warnings.iter().cloned());
    gathered.warnings.extend(judge::warnings(&solution));
    Ok((gathered, solution.report))
}
