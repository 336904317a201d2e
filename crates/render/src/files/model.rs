//! Models in files.

use std::path::{Path, PathBuf};

use motes_codecs::open_gaussians;
use motes_formats::Result;
use motes_formats::decomposition::read_decomposition;
use motes_formats::ply::RenderMode;
use motes_formats::selection::BoundGaussians;
use motes_raster::Antialias;

use crate::model::{AntialiasChoice, Model, ModelInput};

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
}
