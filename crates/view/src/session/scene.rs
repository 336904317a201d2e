//! What a session has that no act changes.

use std::path::PathBuf;

use edit::plan::EditPlanDocument;
use edit::run::{EditError, Editors, Resources};
use motes_formats::ply::PlyWriteOptions;
use motes_formats::selection::BoundGaussians;
use motes_raster::Antialias;
use motes_scene::{Capture, Convention};
use segment_select::SelectSource;

/// The light that a decomposed scene was captured in, as a plan names it.
#[derive(Clone, Debug)]
pub struct OwnLight {
    /// Absolute path of the map.
    pub file: String,
    /// Its axes.
    pub convention: Convention,
    /// Vector in world to its zenith.
    pub zenith: [f64; 3],
}

/// An environment map that may be chosen.
#[derive(Clone, Debug)]
pub struct OfferedMap {
    /// Of its file.
    pub name: String,
    /// Absolute path.
    pub file: String,
}

/// What a session has that no act changes.
pub struct Scene {
    /// For people.
    pub title: String,
    /// The footprint to draw the Gaussians with.
    pub antialias: Antialias,
    /// How Gaussians are written.
    pub write_options: PlyWriteOptions,
    /// Views and the document that they are from.
    pub capture: Option<(Capture, PathBuf)>,
    /// Of a decomposed scene.
    pub own_light: Option<OwnLight>,
    /// Environment maps that the page offers.
    pub maps: Vec<OfferedMap>,
    /// The plan without operations: its seed, and what holds for all of them.
    pub template: EditPlanDocument,
    /// Names plans in errors.
    pub plan_name: PathBuf,
    /// Keeps the views of the Gaussians as they were read.
    pub cache: Option<PathBuf>,
    /// The Gaussians that selections in files belong to.
    pub bound: BoundGaussians,
}

impl Scene {
    /// Runs `work` with what operations may look at. No program is started.
    pub(crate) fn with_resources<T>(&self, work: impl FnOnce(&Resources<'_>) -> T) -> T {
        let bound = || Ok(self.bound.clone());
        work(&Resources {
            plan: &self.plan_name,
            // Plans of a session name files by absolute paths.
            folder: std::path::Path::new("/"),
            bound: &bound,
            capture: self.capture.as_ref().map(|(capture, path)| (capture, path.as_path())),
            antialias: self.antialias,
            editors: Editors { named: &[], provider: None, start: false },
            stopped: &|| false,
        })
    }

    /// Views that the page can show: those of cameras without lens distortion.
    pub fn pinhole_views(&self) -> Vec<usize> {
        let Some((capture, _)) = &self.capture else { return Vec::new() };
        let is_pinhole =
            |v: &usize| capture.cameras[capture.views[*v].camera].as_pinhole().is_some();
        (0..capture.views.len()).filter(is_pinhole).collect()
    }

    /// What prompts are about.
    pub(crate) fn source<'a>(&'a self, gaussians: &'a motes_scene::Gaussians) -> SelectSource<'a> {
        let source = SelectSource::new(gaussians, self.antialias);
        match &self.capture {
            Some((capture, path)) => source.with_capture(capture, path),
            None => source,
        }
    }
}

/// The sentence of an error, and what to do about it.
pub(crate) fn sentence(error: &EditError) -> String {
    match error {
        EditError::Plan { cause, remedy: Some(remedy), .. } => format!("{cause}: {remedy}"),
        EditError::Plan { cause, .. } => cause.clone(),
        error => error.to_string(),
    }
}
