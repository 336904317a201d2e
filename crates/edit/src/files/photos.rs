//! Photos of the capture that get the edit.

use std::path::Path;

use motes_raster::Antialias;
use motes_scene::{Capture, Gaussians};
use motes_stage::StageError;
use train_splat::TrainingImage;
use train_splat::files::load_training_images;

use super::EditJob;
use crate::EditState;
use crate::photo::{PhotoView, photo_after};
use crate::run::Preview;

/// The photos that were asked for.
pub(super) struct Photos(Vec<TrainingImage>);

impl Photos {
    /// Reads the photos of the views that the job names.
    ///
    /// # Errors
    /// There is no such view, or its photo cannot be read.
    pub(super) fn load(job: &EditJob<'_>, capture: Option<&Capture>) -> anyhow::Result<Self> {
        let (Some(capture), Some(document)) = (capture, job.capture) else {
            return Ok(Self(Vec::new()));
        };
        let mut views = Vec::new();
        for name in job.photos {
            let Some(view) = capture.view_named(name) else {
                let text = format!("the capture has no view \"{name}\": {}", document.display());
                let known: Vec<&str> =
                    capture.views.iter().take(5).map(|v| v.name.as_str()).collect();
                let help = format!("it has {}, ...", known.join(", "));
                return Err(StageError::usage(text).help(help).into());
            };
            views.push(view);
        }
        Ok(Self(load_training_images(document, capture, &views)?))
    }

    /// Whether none was asked for.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Each with the edit in it.
    pub(super) fn after(
        &self,
        before: &Gaussians,
        after: &EditState,
        antialias: Antialias,
    ) -> Vec<Preview> {
        let edited = |photo: &TrainingImage| {
            let camera_from_world = &photo.camera_from_world;
            let view = PhotoView { camera: &photo.camera, camera_from_world, antialias };
            let stem = Path::new(&photo.name).file_stem().unwrap_or_default().to_string_lossy();
            let file = format!("photo-{stem}.png");
            Preview { file, image: photo_after(&photo.image, before, after, view) }
        };
        self.0.iter().map(edited).collect()
    }
}
