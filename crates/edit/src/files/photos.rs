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
pub(super) struct Photos {
    photos: Vec<TrainingImage>,
    /// Before the first operation; empty where no photo was asked for.
    before: Gaussians,
}

impl Photos {
    /// Reads the photos of the views that the job names, and keeps the Gaussians before the first operation.
    ///
    /// # Errors
    /// There is no such view, or its photo cannot be read.
    pub(super) fn load(
        job: &EditJob<'_>,
        capture: Option<&Capture>,
        before: &Gaussians,
    ) -> anyhow::Result<Self> {
        let asked = job.capture.filter(|_| !job.photos.is_empty());
        let (Some(capture), Some(document)) = (capture, asked) else {
            return Ok(Self { photos: Vec::new(), before: Gaussians::empty(0) });
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
        let photos = load_training_images(document, capture, &views)?;
        Ok(Self { photos, before: before.clone() })
    }

    /// Each with the edit in it.
    pub(super) fn after(&self, after: &EditState, antialias: Antialias) -> Vec<Preview> {
        let edited = |photo: &TrainingImage| {
            let camera_from_world = &photo.camera_from_world;
            let view = PhotoView { camera: &photo.camera, camera_from_world, antialias };
            let stem = Path::new(&photo.name).file_stem().unwrap_or_default().to_string_lossy();
            let file = format!("photo-{stem}.png");
            Preview { file, image: photo_after(&photo.image, &self.before, after, view) }
        };
        self.photos.iter().map(edited).collect()
    }
}
