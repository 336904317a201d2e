//! What prompts are about: Gaussians and, for prompts in pixels, the views of a capture.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use motes_formats::selection::BoundGaussians;
use motes_raster::{Antialias, RenderOptions};
use motes_scene::{Capture, Gaussians, Pinhole, Split};
use rayon::prelude::*;

use crate::error::SelectError;
use crate::index::SceneIndex;
use crate::plane::SupportPlane;
use crate::provider::MaskProvider;
use crate::view_data::ViewData;

/// Longest side of the pictures that prompts are answered on, pixels: more is slower, and finer than the
/// Gaussians of most scenes.
pub const WORKING_PX: usize = 640;
/// Views that are prepared; they are spread over all of them.
pub const MOST_VIEWS: usize = 24;

/// Gaussians and, for prompts in pixels, views.
pub struct SelectSource<'a> {
    /// What is selected from.
    pub gaussians: &'a Gaussians,
    /// How they are drawn.
    pub options: RenderOptions,
    pub(crate) capture: Option<(&'a Capture, PathBuf)>,
    bound: Option<BoundGaussians>,
    pub(crate) cache: Option<PathBuf>,
    segmenter: Option<&'a dyn MaskProvider>,
    index: OnceLock<Arc<SceneIndex>>,
}

impl<'a> SelectSource<'a> {
    /// Gaussians without views: shapes, properties and files can select.
    pub fn new(gaussians: &'a Gaussians, antialias: Antialias) -> Self {
        let options = RenderOptions { antialias, ..RenderOptions::default() };
        let (capture, bound, cache, segmenter) = (None, None, None, None);
        Self { gaussians, options, capture, bound, cache, segmenter, index: OnceLock::new() }
    }

    /// Adds the views of a capture; `path` is its document, photos lie beside it.
    #[must_use]
    pub fn with_capture(mut self, capture: &'a Capture, path: &Path) -> Self {
        self.capture = Some((capture, path.parent().unwrap_or(Path::new("")).to_owned()));
        self
    }

    /// Says which file the Gaussians are, so that selections of it can be read and views cached.
    #[must_use]
    pub fn bound_to(mut self, gaussians: BoundGaussians) -> Self {
        self.bound = Some(gaussians);
        self
    }

    /// Keeps prepared views in a folder. Needs [`Self::bound_to`].
    #[must_use]
    pub fn with_cache(mut self, folder: &Path) -> Self {
        self.cache = Some(folder.to_owned());
        self
    }

    /// Takes views that were prepared before, for the same Gaussians and capture.
    ///
    /// # Panics
    /// When they were prepared for another number of Gaussians.
    #[must_use]
    pub fn with_index(self, index: Arc<SceneIndex>) -> Self {
        assert_eq!(index.gaussians, self.gaussians.len(), "views of the same Gaussians");
        Self { index: OnceLock::from(index), ..self }
    }

    /// Answers clicks, boxes and strokes by another segmenter than the graph cut.
    #[must_use]
    pub fn with_segmenter(mut self, segmenter: &'a dyn MaskProvider) -> Self {
        self.segmenter = Some(segmenter);
        self
    }

    /// The segmenter, when it is not the graph cut.
    pub(crate) fn segmenter(&self) -> Option<&'a dyn MaskProvider> {
        self.segmenter
    }

    /// The file of the Gaussians, when it was said.
    pub fn bound(&self) -> Option<&BoundGaussians> {
        self.bound.as_ref()
    }

    /// The capture.
    ///
    /// # Errors
    /// When there is none; `what` needs it.
    pub fn capture(&self, what: &'static str) -> Result<&'a Capture, SelectError> {
        self.capture.as_ref().map(|c| c.0).ok_or(SelectError::NoCapture(what))
    }

    /// A view by its name, with or without its suffix.
    ///
    /// # Errors
    /// When there is no capture or no such view, or more than one.
    pub fn view_named(&self, name: &str) -> Result<usize, SelectError> {
        let capture = self.capture("a prompt in pixels")?;
        capture.view_named(name).ok_or_else(|| {
            let names = capture.views.iter().take(4).map(|v| format!("\"{}\"", v.name));
            let mut known = names.collect::<Vec<_>>().join(", ");
            if capture.views.len() > 4 {
                known.push_str(", ...");
            }
            SelectError::NoSuchView { name: name.into(), count: capture.views.len(), known }
        })
    }

    /// The camera of a view as it was taken.
    ///
    /// # Errors
    /// When it has distortion, or there is no capture.
    pub fn camera(&self, view: usize) -> Result<Pinhole, SelectError> {
        let capture = self.capture("a view")?;
        let view = &capture.views[view];
        let camera = capture.cameras[view.camera].as_pinhole();
        camera.ok_or_else(|| SelectError::NotPinhole(view.name.clone()))
    }

    /// Views that are prepared: training views spread by farthest points, or any where there are none.
    pub fn prepared_views(&self) -> Result<Vec<usize>, SelectError> {
        let capture = self.capture("a prompt in pixels")?;
        let mut views = capture.views_of(Split::Train);
        if views.is_empty() {
            views = (0..capture.views.len()).collect();
        }
        let center = |v: usize| capture.views[v].camera_from_world.center_in_world();
        let mut chosen: Vec<usize> = views.iter().copied().take(1).collect();
        let mut nearest = vec![f64::INFINITY; views.len()];
        while chosen.len() < MOST_VIEWS.min(views.len()) {
            let last: DVec3 = center(chosen[chosen.len() - 1]);
            for (near, &v) in nearest.iter_mut().zip(&views) {
                *near = near.min(if chosen.contains(&v) { -1.0 } else { center(v).distance(last) });
            }
            let far =
                (0..views.len()).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]).then(b.cmp(&a)));
            let Some(far) = far.filter(|&k| nearest[k] >= 0.0) else { break };
            chosen.push(views[far]);
        }
        chosen.sort_unstable();
        Ok(chosen)
    }

    /// All views prepared together; computed on the first call.
    ///
    /// # Errors
    /// When there is no capture, a camera has distortion or a photo cannot be read.
    pub fn index(&self) -> Result<&SceneIndex, SelectError> {
        self.shared_index().map(|index| &**index)
    }

    /// [`Self::index`], to keep for [`Self::with_index`].
    ///
    /// # Errors
    /// As [`Self::index`].
    pub fn shared_index(&self) -> Result<&Arc<SceneIndex>, SelectError> {
        if let Some(index) = self.index.get() {
            return Ok(index);
        }
        let chosen = self.prepared_views()?;
        let views: Result<Vec<ViewData>, SelectError> =
            chosen.par_iter().map(|&view| self.prepare(view)).collect();
        let index = SceneIndex::new(chosen, views?, self.gaussians.len());
        Ok(self.index.get_or_init(|| Arc::new(index)))
    }

    /// The plane that was found, if views were prepared at all.
    pub(crate) fn found_plane(&self) -> Option<SupportPlane> {
        self.index.get().and_then(|index| index.plane().copied())
    }

    /// A camera at the working size.
    pub(crate) fn working(camera: &Pinhole) -> Pinhole {
        Self::at_most(camera, WORKING_PX)
    }

    /// A camera whose longest side has at most this many pixels.
    pub(crate) fn at_most(camera: &Pinhole, most_px: usize) -> Pinhole {
        let longest = camera.width.max(camera.height);
        if longest <= most_px {
            return *camera;
        }
        let side = |px: usize| (px * most_px).div_ceil(longest).max(1);
        camera.resized(side(camera.width), side(camera.height))
    }
}
