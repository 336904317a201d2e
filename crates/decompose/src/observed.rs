//! A surface with what the photos show of it.

use glam::Vec3;
use motes_scene::Surface;

use crate::decompose::DecomposeError;
use crate::samples::{Sample, SeenView, choose_samples, vertex_radiance};
use crate::{Photo, TracedSurface};

/// A surface with what the photos show of it.
pub(crate) struct Observed<'a> {
    pub scene: TracedSurface,
    pub views: Vec<SeenView<'a>>,
    /// Points that are seen by enough photos: three, or all where there are fewer.
    pub samples: Vec<Sample>,
    /// What every vertex sends out, per light; empty where no light of the surface itself is modelled.
    pub vertex_radiance: Vec<Vec<Vec3>>,
}

impl<'a> Observed<'a> {
    /// Chooses about `wanted` points and looks up what is sent out under so many lights.
    pub(crate) fn new(
        scene: TracedSurface,
        views: Vec<SeenView<'a>>,
        wanted: usize,
        lights: usize,
    ) -> Result<Self, DecomposeError> {
        let min_views = 3.min(views.len()).max(1);
        let samples = choose_samples(&scene, &views, wanted, min_views);
        if samples.is_empty() {
            return Err(DecomposeError::NothingSeen(min_views));
        }
        let vertex_radiance =
            (0..lights).map(|light| vertex_radiance(&scene, &views, light)).collect();
        Ok(Self { scene, views, samples, vertex_radiance })
    }

    /// The same photos on a surface that has moved.
    pub(crate) fn move_to(
        &mut self,
        surface: Surface,
        photos: &'a [Photo],
        wanted: usize,
    ) -> Result<(), DecomposeError> {
        let scene = TracedSurface::new(surface)?;
        let views = photos.iter().map(|p| SeenView::new(p, &scene)).collect();
        *self = Self::new(scene, views, wanted, self.vertex_radiance.len())?;
        Ok(())
    }
}
