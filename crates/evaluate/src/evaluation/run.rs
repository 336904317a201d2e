//! Scoring sets of renders against the photos of a capture.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use motes_formats::FormatError;
use motes_raster::{RenderOptions, render};
use motes_scene::{Capture, ImageF32, ImageU8, Pinhole, Split, SplitChoice};

use super::EvaluationOptions;
use crate::lpips::Lpips;
use crate::page::ModelScores;
use crate::photos::{load_photo, load_render};
use crate::score::{Photo, ViewRow, score_view};
use render::frames::{PlanError, pinhole_of, view_stems, views_of};
use render::model::{AntialiasChoice, Model};

/// Where the renders come from.
#[derive(Clone, Debug)]
pub enum Contestant {
    /// Gaussians of a file, rendered here.
    Model(PathBuf, Model),
    /// A folder of pictures, rendered by any program and named after the views.
    Folder(PathBuf),
}

impl Contestant {
    /// Reads Gaussians.
    ///
    /// # Errors
    /// When the file cannot be read or is not a Gaussian PLY.
    pub fn load_model(path: &Path, choice: AntialiasChoice) -> Result<Self, FormatError> {
        Ok(Self::Model(path.to_owned(), Model::load(path, choice)?))
    }

    /// File or folder.
    pub fn path(&self) -> &Path {
        match self {
            Self::Model(path, _) | Self::Folder(path) => path,
        }
    }

    fn gaussians(&self) -> Option<usize> {
        match self {
            Self::Model(_, model) => Some(model.gaussians.len()),
            Self::Folder(_) => None,
        }
    }
}

/// What is scored: views of a capture with their photos.
#[derive(Clone, Debug)]
pub struct Course<'a> {
    document: &'a Path,
    capture: &'a Capture,
    stems: Vec<String>,
    views: Vec<(usize, Pinhole)>,
}

/// A view just scored.
#[derive(Debug)]
pub struct ScoredView<'a> {
    /// Its role in the capture.
    pub split: Split,
    /// Name of the view.
    pub name: &'a str,
    /// File stem for its pictures.
    pub stem: &'a str,
    /// The photo.
    pub photo: &'a Photo,
    /// The render, 8 bit.
    pub render: &'a ImageU8,
}

impl<'a> Course<'a> {
    /// The views of all `splits`, each once, in the order of the capture.
    ///
    /// # Errors
    /// When a split has no views or a view no pinhole camera.
    pub fn new(
        document: &'a Path,
        capture: &'a Capture,
        splits: &[SplitChoice],
    ) -> Result<Self, PlanError> {
        let mut indices = BTreeSet::new();
        for split in splits {
            indices.extend(views_of(capture, split.split())?);
        }
        let with_camera = |view| Ok((view, pinhole_of(capture, view)?));
        let views = indices.into_iter().map(with_camera).collect::<Result<_, PlanError>>()?;
        Ok(Self { document, capture, stems: view_stems(capture), views })
    }

    /// Number of views that one contestant is scored on.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether there is no view.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// Number of views of a split among them.
    pub fn count_of(&self, split: SplitChoice) -> usize {
        let split_of = |view: usize| self.capture.views[view].split;
        self.views.iter().filter(|(view, _)| split.includes(split_of(*view))).count()
    }

    /// Width and height of the images when all have one size, pixels.
    pub fn common_size(&self) -> Option<[u64; 2]> {
        let size = |(_, camera): &(usize, Pinhole)| [camera.width as u64, camera.height as u64];
        let first = self.views.first().map(size)?;
        self.views.iter().all(|view| size(view) == first).then_some(first)
    }

    /// Scores one contestant on all views and shows each to `watch`.
    ///
    /// # Errors
    /// When a picture cannot be read or scored, or what `watch` returns.
    pub fn run<E: From<FormatError>>(
        &self,
        contestant: &Contestant,
        options: &EvaluationOptions,
        lpips: Option<&Lpips>,
        mut watch: impl FnMut(ScoredView) -> Result<(), E>,
    ) -> Result<ModelScores, E> {
        let mut rows = Vec::new();
        for &(view, camera) in &self.views {
            let record = &self.capture.views[view];
            let photo = load_photo(self.document, self.capture, view, options.background.0)?;
            let render = self.render(contestant, view, &camera, options)?;
            let score = score_view(&photo, &render, &options.score_options(lpips))
                .map_err(|error| FormatError::invalid(&record.image, "", error.to_string()))?;
            watch(ScoredView {
                split: record.split,
                name: &record.name,
                stem: &self.stems[view],
                photo: &photo,
                render: &render.to_u8(),
            })?;
            rows.push(ViewRow { name: record.name.clone(), split: record.split, score });
        }
        let name = contestant.path().display().to_string();
        Ok(ModelScores { name, gaussians: contestant.gaussians(), rows })
    }

    fn render(
        &self,
        contestant: &Contestant,
        view: usize,
        camera: &Pinhole,
        options: &EvaluationOptions,
    ) -> Result<ImageF32, FormatError> {
        let (record, stem) = (&self.capture.views[view], &self.stems[view]);
        let background = options.background.0;
        match contestant {
            Contestant::Model(_, model) => {
                let gain = model.gain(options.view_exposure, record.exposure_stops);
                let (antialias, dials) = (model.antialias, options.raster);
                let options = RenderOptions { background, antialias, dials, ..Default::default() };
                let pose = &record.camera_from_world;
                Ok(render(&model.gaussians, camera, pose, &options).color.scaled(gain))
            }
            Contestant::Folder(folder) => {
                let size = (camera.width, camera.height);
                load_render(folder, &record.name, stem, size, background).map(|i| i.to_f32())
            }
        }
    }
}
