//! A surface with what the photos show of it.

use glam::Vec3;
use motes_scene::Surface;

use super::most_telling::most_telling;
use super::photo::Photo;
use super::samples::{Sample, SeenView, Wanted, choose_samples, vertex_radiance};
use super::traced_surface::TracedSurface;
use crate::error::DecomposeError;

/// A surface with what the photos show of it.
#[derive(Debug)]
pub struct Observed<'a> {
    /// The surface.
    pub scene: TracedSurface,
    /// The photos with their hits.
    pub views: Vec<SeenView<'a>>,
    /// Points that are seen by enough photos: three, or all where there are fewer.
    pub samples: Vec<Sample>,
    /// How many points were asked for.
    pub wanted: Wanted,
    /// What every vertex sends out, per light; empty where no light of the surface itself is modeled.
    pub vertex_radiance: Vec<Vec<Vec3>>,
}

impl<'a> Observed<'a> {
    /// A surface before any photo is looked at.
    pub fn unseen(scene: TracedSurface) -> Self {
        let (views, samples, vertex_radiance) = (Vec::new(), Vec::new(), Vec::new());
        Self { scene, views, samples, wanted: Wanted::default(), vertex_radiance }
    }

    /// Chooses points and looks up what is sent out under so many lights.
    ///
    /// # Errors
    /// When no point is seen by enough photos.
    pub fn new(
        scene: TracedSurface,
        views: Vec<SeenView<'a>>,
        wanted: Wanted,
        lights: usize,
    ) -> Result<Self, DecomposeError> {
        let min_views = 3.min(views.len()).max(1);
        let mut samples = choose_samples(&scene, &views, wanted.points, min_views);
        for sample in &mut samples {
            let all = std::mem::take(&mut sample.observations);
            sample.observations = most_telling(all, wanted.observations);
        }
        if samples.is_empty() {
            return Err(DecomposeError::NothingSeen(min_views));
        }
        let vertex_radiance =
            (0..lights).map(|light| vertex_radiance(&scene, &views, light)).collect();
        Ok(Self { scene, views, samples, wanted, vertex_radiance })
    }

    /// The same photos on a surface that has moved.
    ///
    /// # Errors
    /// When no point is seen by enough photos, or the mesh is broken.
    pub fn move_to(&mut self, surface: Surface, photos: &'a [Photo]) -> Result<(), DecomposeError> {
        *self = Self::of(surface, photos, self.wanted, self.vertex_radiance.len())?;
        Ok(())
    }

    /// What these photos show of a surface.
    ///
    /// # Errors
    /// As [`Self::move_to`].
    pub fn of(
        surface: Surface,
        photos: &'a [Photo],
        wanted: Wanted,
        lights: usize,
    ) -> Result<Self, DecomposeError> {
        let scene = TracedSurface::new(surface)?;
        let views = photos.iter().map(|p| SeenView::new(p, &scene)).collect();
        Self::new(scene, views, wanted, lights)
    }
}
