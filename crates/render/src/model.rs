//! A model as a file says it wants to be drawn.

pub use crate::options::{AntialiasChoice, ModelInput, ViewExposure};
use motes_raster::Antialias;
use motes_scene::{ExposureResponse, Gaussians};

/// Gaussians and how they were trained to be drawn.
#[derive(Clone, Debug)]
pub struct Model {
    /// The Gaussians.
    pub gaussians: Gaussians,
    /// The footprint to draw them with.
    pub antialias: Antialias,
    /// How the brightness of photos follows their metadata, when the file says so.
    pub exposure_response: Option<ExposureResponse>,
}

impl Model {
    /// Factor on the colors of a picture of a view that was taken at `stops`.
    pub fn gain(&self, choice: ViewExposure, stops: Option<f64>) -> f32 {
        match (choice, self.exposure_response) {
            (ViewExposure::Metadata, Some(response)) => response.gain(stops),
            _ => 1.0,
        }
    }
}
