//! The flags of pages, meshes and shadows.

use std::path::PathBuf;

use crate::html::pack::PackOptions;
use crate::mesh::MeshOptions;
use crate::mesh::target::Target;
use crate::shadow::ShadowOptions;
use clap::Args;
use relight::LightOptions;
use render::frames::{Background, parse_background};
use serde::Serialize;

/// What is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Asset {
    /// One HTML file that shows the Gaussians.
    Html,
    /// A relightable mesh, with its light.
    Mesh,
    /// The shadow of the objects on the ground.
    ShadowPlane,
}

/// The flags.
#[derive(Args, Clone, Debug, Serialize)]
pub struct AssetOptions {
    /// Write one HTML file with a viewer, the same as --format html
    #[arg(long, conflicts_with = "format", help_heading = "HTML page")]
    pub html: bool,

    /// Of a page.
    #[command(flatten)]
    #[serde(flatten)]
    pub page: PageOptions,

    /// Program that opens the mesh; sets the axes of the environment map beside it
    #[arg(long, value_enum, value_name = "PROGRAM", default_value_t = Target::Blender,
        help_heading = "Mesh")]
    pub target: Target,

    /// Meters per world unit
    #[arg(long, value_name = "METERS", default_value_t = 1.0, value_parser = parse_unit,
        help_heading = "Mesh")]
    pub unit: f64,

    /// Of a mesh.
    #[command(flatten)]
    #[serde(flatten)]
    pub mesh: MeshOptions,

    /// Of a shadow.
    #[command(flatten)]
    #[serde(flatten)]
    pub shadow: ShadowOptions,

    /// Light beside the mesh, of the shadow, and to turn on the page.
    #[command(flatten)]
    #[serde(flatten)]
    pub light: LightOptions,
}

/// The flags of a page.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "HTML page")]
pub struct PageOptions {
    /// Title of the page [default: the name of the input]
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,

    /// Maximum number of held-out photos of --capture to compare with
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub photos: usize,

    /// Longer side of embedded photos in pixels
    #[arg(long, value_name = "PX", default_value_t = 960,
        value_parser = clap::value_parser!(u32).range(16..=16384))]
    pub photo_size: u32,

    /// Gaussians to compare with, in any format that export reads
    #[arg(long, value_name = "FILE")]
    pub compare_with: Option<PathBuf>,

    /// Background color: black, white or r,g,b from 0 to 1
    #[arg(long, value_name = "COLOR", default_value = "black", value_parser = parse_background)]
    pub background: Background,

    /// What is left out.
    #[command(flatten)]
    #[serde(flatten)]
    pub pack: PackOptions,
}

fn parse_unit(text: &str) -> Result<f64, String> {
    let unit = text.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
    unit.ok_or_else(|| "expected a number above 0".into())
}
