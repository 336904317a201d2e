//! Gaussians and views, read.

use std::path::{Path, PathBuf};

use crate::SelectSource;
use motes_codecs::open_gaussians;
use motes_formats::capture::read_capture;
use motes_formats::decomposition::read_decomposition;
use motes_formats::ply::{GaussianFile, RenderMode};
use motes_formats::selection::BoundGaussians;
use motes_raster::Antialias;
use motes_scene::{Capture, View};
use motes_stage::{Context, StageError};

/// A view that is drawn: its planes, and what covers each pixel.
const VIEW_BYTES_PER_PIXEL: u64 = 72;

/// What is selected from.
pub struct Inputs {
    /// Gaussians and what their file says.
    pub file: GaussianFile,
    /// Which file it is.
    pub bound: BoundGaussians,
    /// Views and the document that they are from.
    pub capture: Option<(Capture, PathBuf)>,
}

impl Inputs {
    /// Reads Gaussians, or those of a scene folder, and a capture.
    ///
    /// # Errors
    /// When a file is missing or malformed, or there are no Gaussians.
    pub fn load(
        gaussians: Option<&Path>,
        scene: Option<&Path>,
        capture: Option<&Path>,
        context: &Context,
    ) -> anyhow::Result<Self> {
        let (path, decomposition) = match (gaussians, scene) {
            (Some(path), _) => (path.to_owned(), None),
            (None, Some(scene)) => {
                context.input("scene", scene)?;
                let decomposition = read_decomposition(scene)?;
                (decomposition.gaussians.clone(), Some(decomposition))
            }
            (None, None) => {
                return Err(StageError::usage("--gaussians or --scene is needed").into());
            }
        };
        context.input("gaussians", &path)?;
        let file = open_gaussians(&path)?;
        if file.gaussians.is_empty() {
            let text = format!("there are no Gaussians to select from: {}", path.display());
            return Err(StageError::bad_input(text).into());
        }
        let count = file.gaussians.len();
        let bound = match decomposition {
            Some(decomposition) => decomposition.bound_gaussians(count)?,
            None => BoundGaussians::of_file(&path, count)?,
        };
        let capture = match capture {
            None => None,
            Some(path) => {
                context.input("capture", path)?;
                let capture = read_capture(path)?;
                let camera = |view: &View| &capture.cameras[view.camera];
                let sizes = capture.views.iter().map(camera).map(|c| (c.width, c.height));
                context.need_memory_for_pictures(sizes, VIEW_BYTES_PER_PIXEL)?;
                Some((capture, path.to_owned()))
            }
        };
        Ok(Self { file, bound, capture })
    }

    /// What selectors work on.
    pub fn source(&self) -> SelectSource<'_> {
        let antialias = match self.file.render_mode {
            Some(RenderMode::Mip) => Antialias::Mip,
            _ => Antialias::Classic,
        };
        let source =
            SelectSource::new(&self.file.gaussians, antialias).bound_to(self.bound.clone());
        match &self.capture {
            Some((capture, path)) => source.with_capture(capture, path),
            None => source,
        }
    }
}
