//! A model as a file says it wants to be drawn.

use std::path::Path;

use clap::ValueEnum;
use motes_formats::Result;
use motes_formats::ply::{RenderMode, open_gaussians};
use motes_raster::Antialias;
use motes_scene::Gaussians;
use serde::Serialize;

/// Which pixel footprint Gaussians are drawn with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AntialiasChoice {
    /// As the PLY says, classic when it says nothing
    #[default]
    Auto,
    /// Dilate by 0.3 px², as INRIA-compatible viewers do
    Classic,
    /// Dilate and keep the energy (Mip-Splatting)
    Mip,
}

/// Gaussians and how they were trained to be drawn.
#[derive(Clone, Debug)]
pub struct Model {
    /// The Gaussians.
    pub gaussians: Gaussians,
    /// The footprint to draw them with.
    pub antialias: Antialias,
}

impl Model {
    /// Reads a PLY.
    ///
    /// # Errors
    /// When it cannot be read or is no Gaussian PLY.
    pub fn load(path: &Path, choice: AntialiasChoice) -> Result<Self> {
        let file = open_gaussians(path)?;
        let antialias = match (choice, file.render_mode) {
            (AntialiasChoice::Mip, _) | (AntialiasChoice::Auto, Some(RenderMode::Mip)) => {
                Antialias::Mip
            }
            _ => Antialias::Classic,
        };
        Ok(Self { gaussians: file.gaussians, antialias })
    }
}
