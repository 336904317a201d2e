//! A surface with what the photos show of it.

use std::sync::Arc;

use glam::Vec3;
use motes_scene::Surface;

use super::local_factors::LocalFactors;
use super::most_telling::most_telling;
use super::photo::Photo;
use super::samples::{Sample, SeenView, Wanted, choose_samples, vertex_radiance};
use super::traced_surface::TracedSurface;
use crate::error::DecomposeError;
use crate::illumination::LocalLight;

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
    /// What the light at infinity does not say, where the observations are divided by it.
    pub local_light: Option<Arc<LocalLight>>,
}

impl<'a> Observed<'a> {
    /// A surface before any photo is looked at.
    pub fn unseen(scene: TracedSurface) -> Self {
        let (views, samples, vertex_radiance) = (Vec::new(), Vec::new(), Vec::new());
        let (wanted, local_light) = (Wanted::default(), None);
        Self { scene, views, samples, wanted, vertex_radiance, local_light }
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
        Ok(Self { scene, views, samples, wanted, vertex_radiance, local_light: None })
    }

    /// The same photos on a surface that has moved.
    ///
    /// # Errors
    /// When no point is seen by enough photos, or the mesh is broken.
    pub fn move_to(&mut self, surface: Surface, photos: &'a [Photo]) -> Result<(), DecomposeError> {
        let local_light = self.local_light.take();
        // The hits of all photos are large: those before go first.
        (self.views, self.samples) = (Vec::new(), Vec::new());
        *self = Self::of(surface, photos, self.wanted, self.vertex_radiance.len())?;
        if let Some(local_light) = local_light {
            self.light_evenly(local_light);
        }
        Ok(())
    }

    /// Divides what the photos show of the points by a local light, which leaves what the light at infinity gives.
    pub fn light_evenly(&mut self, local_light: Arc<LocalLight>) {
        for sample in &mut self.samples {
            let factor = local_light.factor(sample.position, sample.normal);
            sample.observations.iter_mut().for_each(|o| o.radiance /= factor);
        }
        self.local_light = Some(local_light);
    }

    /// The local light where pixels meet the surface; none without one.
    pub(crate) fn local_factors(&self) -> Option<LocalFactors<'_>> {
        self.local_light.as_deref().map(|light| LocalFactors::new(&self.scene, light))
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
