//! Scoring contestants on photos that are read one by one.

use std::path::Path;

use motes_formats::FormatError;
use motes_raster::{RenderOptions, render};
use motes_scene::{ImageF32, Pinhole};

use super::photos::{load_photo, load_render};
use crate::evaluation::{Contestant, Course, EvaluationOptions, ScoredView};
use crate::lpips::Lpips;
use crate::page::ModelScores;
use crate::score::{ViewRow, score_view};
use render::model::{AntialiasChoice, Model};

impl Contestant {
    /// Reads Gaussians.
    ///
    /// # Errors
    /// When the file cannot be read or is not a Gaussian PLY.
    pub fn load_model(path: &Path, choice: AntialiasChoice) -> Result<Self, FormatError> {
        Ok(Self::Model(path.to_owned(), Model::load(path, choice)?))
    }
}

impl Course<'_> {
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
                let (antialias, parameters) = (model.antialias, options.raster);
                let options =
                    RenderOptions { background, antialias, parameters, ..Default::default() };
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
