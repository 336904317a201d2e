//! What the stage `relight` says when it is done.

use std::fmt;
use std::path::PathBuf;

use crate::{PictureStats, Quality, QualityOptions};
use clap::ValueEnum;
use serde::Serialize;

use super::{LiftReport, LightReport};

/// What was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Product {
    /// A folder of pictures
    Pictures,
    /// Gaussians with baked colors
    Splat,
    /// A scene folder with the new light
    Scene,
}

/// What the stage says: of a scene under a light, or of relit views.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Outcome {
    /// Of a scene under a light.
    Relit(Box<RelightReport>),
    /// Of views lifted to 3D.
    Lifted(Box<LiftReport>),
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Relit(report) => report.fmt(f),
            Self::Lifted(report) => report.fmt(f),
        }
    }
}

/// The report.
#[derive(Clone, Debug, Serialize)]
pub struct RelightReport {
    /// What was made.
    pub product: Product,
    /// Where.
    pub output: PathBuf,
    /// The light.
    pub light: LightReport,
    /// Time against noise.
    pub quality: Quality,
    /// Directions toward the light per shaded pixel.
    pub light_samples: u32,
    /// Directions of the lobes per shaded pixel.
    pub brdf_samples: u32,
    /// One in this many pixels is shaded, per direction.
    pub shade_every: usize,
    /// Strength of the filter of light.
    pub denoise: f32,
    /// Surfaces that indirect light comes over.
    pub bounces: u32,
    /// How much of what the model left unexplained under the capture illumination applies under this light, 0 to 1.
    pub residual_share: f32,
    /// Whether the sky that the photos show gives way to that of the light.
    pub sky_replaced: bool,
    /// Gaussians of the scene.
    pub gaussians: usize,
    /// Gaussians whose material is a guess: no training view saw them.
    pub unobserved_gaussians: usize,
    /// Triangles that cast shadows.
    pub triangles: usize,
    /// Number of pictures.
    pub pictures: usize,
    /// Means over the pictures; null without pictures.
    pub picture_means: Option<PictureStats>,
    /// CPU seconds of all threads per light, for the light that surfaces send on.
    pub cpu_seconds_per_light: Option<f64>,
    /// Mean CPU seconds of all threads per picture, reading and writing left out.
    pub cpu_seconds_per_picture: Option<f64>,
    /// Makes a video of numbered pictures.
    pub video_command: Option<String>,
}

impl RelightReport {
    /// The part that does not depend on the product.
    pub fn new(
        product: Product,
        output: PathBuf,
        light: LightReport,
        quality: &QualityOptions,
        scene: &crate::RelightScene,
    ) -> Self {
        let (light_samples, brdf_samples) = quality.samples();
        Self {
            product,
            output,
            light,
            quality: quality.quality,
            light_samples,
            brdf_samples,
            shade_every: quality.shade_every(),
            denoise: quality.denoise_strength(),
            bounces: quality.bounces(scene.indirect),
            residual_share: 0.0,
            sky_replaced: false,
            gaussians: scene.gaussians.len(),
            unobserved_gaussians: scene.unobserved(),
            triangles: scene.triangles(),
            pictures: 0,
            picture_means: None,
            cpu_seconds_per_light: None,
            cpu_seconds_per_picture: None,
            video_command: None,
        }
    }
}

impl fmt::Display for RelightReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let light = &self.light;
        writeln!(
            f,
            "light: {}, exposure {}{} ({})",
            light.source,
            significant(light.exposure),
            light.ev100.map_or(String::new(), |ev| format!(", EV {ev:.1} at ISO 100")),
            light.exposure_from
        )?;
        let folder = self.output.display();
        match self.product {
            Product::Pictures => {
                let s = if self.pictures == 1 { "" } else { "s" };
                write!(f, "{} picture{s}", self.pictures)?;
                if let Some(seconds) = self.cpu_seconds_per_picture {
                    write!(f, ", {seconds:.2} CPU s each")?;
                }
                if let Some(seconds) = self.cpu_seconds_per_light {
                    write!(f, ", {seconds:.2} per light")?;
                }
                writeln!(f, ": {folder}")?;
            }
            Product::Splat => writeln!(f, "{} Gaussians lit by it: {folder}", self.gaussians)?,
            Product::Scene => writeln!(f, "scene folder with it: {folder}")?,
        }
        let (l, b) = (self.light_samples, self.brdf_samples);
        write!(
            f,
            "samples: {l} of the light and {b} of the lobes per point, {} bounces; residual {:.2}",
            self.bounces, self.residual_share
        )?;
        if let Some(means) = &self.picture_means {
            write!(f, "; noise {:.4} before the filter", means.noise_rms)?;
            if means.unobserved_share > 0.005 {
                let percent = 100.0 * means.unobserved_share;
                write!(f, "\n{percent:.1} % of the pictures show material that no photo saw")?;
            }
        }
        if self.sky_replaced {
            write!(f, "\nsky of the photos: replaced by that of the light")?;
            if self.product == Product::Pictures {
                write!(f, "; --background captured keeps it")?;
            }
        }
        writeln!(f)?;
        let Some(command) = &self.video_command else { return Ok(()) };
        writeln!(f, "to make a video: {command}")
    }
}

/// Four digits, however small.
fn significant(v: f32) -> String {
    if v >= 0.01 { format!("{v:.4}") } else { format!("{v:.3e}") }
}
