//! A model as a file says it wants to be drawn.

pub use crate::options::{AntialiasChoice, ModelInput, ViewExposure};
use std::path::{Path, PathBuf};

use motes_codecs::open_gaussians;
use motes_formats::Result;
use motes_formats::decomposition::read_decomposition;
use motes_formats::ply::RenderMode;
use motes_formats::selection::BoundGaussians;
use motes_raster::Antialias;
use motes_scene::{ExposureResponse, Gaussians};

impl ModelInput {
    /// The file with the Gaussians.
    ///
    /// # Errors
    /// When the scene folder has no readable `decomposition.json`.
    pub fn file(&self) -> Result<PathBuf> {
        match (&self.gaussians, &self.scene) {
            (None, Some(scene)) => Ok(read_decomposition(scene)?.gaussians),
            (gaussians, _) => Ok(gaussians.clone().unwrap_or_default()),
        }
    }

    /// What selections of them are bound to, `count` being their number.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub fn bound(&self, count: usize) -> Result<BoundGaussians> {
        match (&self.gaussians, &self.scene) {
            (None, Some(scene)) => read_decomposition(scene)?.bound_gaussians(count),
            _ => BoundGaussians::of_file(&self.file()?, count),
        }
    }
}

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
    /// Reads Gaussians of any format.
    ///
    /// # Errors
    /// When it cannot be read or is not a file of Gaussians.
    pub fn load(path: &Path, choice: AntialiasChoice) -> Result<Self> {
        let file = open_gaussians(path)?;
        let antialias = match (choice, file.render_mode) {
            (AntialiasChoice::Mip, _) | (AntialiasChoice::Auto, Some(RenderMode::Mip)) => {
                Antialias::Mip
            }
            _ => Antialias::Classic,
        };
        let exposure_response = file.exposure_response;
        Ok(Self { gaussians: file.gaussians, antialias, exposure_response })
    }

    /// Factor on the colors of a picture of a view that was taken at `stops`.
    pub fn gain(&self, choice: ViewExposure, stops: Option<f64>) -> f32 {
        match (choice, self.exposure_response) {
            (ViewExposure::Metadata, Some(response)) => response.gain(stops),
            _ => 1.0,
        }
    }
}
