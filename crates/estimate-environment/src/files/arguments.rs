//! Arguments of `estimate-environment`, and what comes of each source.

use std::path::PathBuf;

use clap::{ArgGroup, Parser};
use motes_protocol::{ProviderFlags, ProviderUse};
use motes_scene::{Convention, ImageF32};
use motes_shading::environment::MapAxes;
use motes_stage::{CommonArgs, HasCommon};
use serde::Serialize;

use super::report::{BallReport, BracketReport};
use super::values::{At, above, direction, outline, reflectance};
use crate::place::PlaceReport;

const EXAMPLES: &str = "\
Examples:
  The light at a point of a splat:
    estimate-environment --capture c.json --gaussians g.ply --at 0,0.2,1.5 -o light.exr
  The light where a pixel of a view points:
    estimate-environment --capture c.json --gaussians g.ply --at IMG_1.jpg,320,400 -o light.exr
  A bracketed series of pictures of a mirror ball:
    estimate-environment --mirror-ball ball/ --ball-reflectance 0.6 -o light.exr --preview l.png
  The light of a decomposed scene, as Blender wants it:
    estimate-environment --scene scene/ --convention blender -o light.exr";

/// Estimate the light of a place as an environment map
#[derive(Parser, Debug, Serialize)]
#[command(name = "estimate-environment", after_help = EXAMPLES)]
#[command(group(ArgGroup::new("source").required(true)
    .args(["scene", "gaussians", "brackets", "mirror_ball", "picture"])))]
pub struct Args {
    /// Scene folder written by decompose: its light, or with --at what arrives at a point of it
    #[arg(long, value_name = "DIR")]
    pub(super) scene: Option<PathBuf>,

    /// Gaussians, seen from --at
    #[arg(long, value_name = "FILE", requires_all = ["capture", "at"])]
    pub(super) gaussians: Option<PathBuf>,

    /// Folder with panoramas of several exposures
    #[arg(long, value_name = "DIR")]
    pub(super) brackets: Option<PathBuf>,

    /// Picture of a mirror ball, or a folder with several exposures of it
    #[arg(long, value_name = "PATH")]
    pub(super) mirror_ball: Option<PathBuf>,

    /// Picture whose surroundings the provider guesses
    #[arg(long, value_name = "FILE", requires = "provider")]
    pub(super) picture: Option<PathBuf>,

    /// Capture of the Gaussians, or of the picture that --view names
    #[arg(long, value_name = "FILE")]
    pub(super) capture: Option<PathBuf>,

    /// View of the capture that the panorama, the ball or the picture was taken from
    #[arg(long, value_name = "NAME", requires = "capture", conflicts_with_all = ["scene", "gaussians"])]
    pub(super) view: Option<String>,

    /// Point that the light arrives at: X,Y,Z, or VIEW,X,Y, a little above what a pixel shows
    #[arg(long, value_name = "PLACE", allow_hyphen_values = true,
        conflicts_with_all = ["brackets", "mirror_ball", "picture"])]
    pub(super) at: Option<At>,

    /// Height over --at, world units
    #[arg(long, value_name = "H", requires = "at", allow_hyphen_values = true)]
    pub(super) lift: Option<f64>,

    /// Environment map to write (OpenEXR)
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: PathBuf,

    /// Picture of the map for people (PNG)
    #[arg(long, value_name = "FILE")]
    pub(super) preview: Option<PathBuf>,

    /// Rows of the map, 16 to 4096; columns are twice as many
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = rows)]
    pub(super) rows: usize,

    /// Axes of the map
    #[arg(long, value_enum, value_name = "AXES", default_value_t)]
    pub(super) convention: Convention,

    /// Direction up in the world, x,y,z [default: the scene's, else the mean up of the cameras]
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true)]
    pub(super) up: Option<String>,

    /// Leave out Gaussians nearer to --at than this, world units [default: 0.05 of the cameras' distance]
    #[arg(long, value_name = "D", requires = "gaussians", value_parser = above(0.0), help_heading = "Splat")]
    pub(super) near: Option<f64>,

    /// Do not look for lights that are clipped or out of view in the shading of surfaces
    #[arg(long, requires = "gaussians", help_heading = "Splat")]
    pub(super) keep_clipped: bool,

    /// Exposure times in seconds, such as 1/250,1/60, in the order of the names [default: of the metadata]
    #[arg(long, value_name = "TIMES", help_heading = "Exposures")]
    pub(super) exposure_times: Option<String>,

    /// Keep what moved between exposures
    #[arg(long, help_heading = "Exposures")]
    pub(super) keep_ghosts: bool,

    /// Center and radius of the ball, pixels [default: found in the picture]
    #[arg(long, value_name = "CX,CY,R", requires = "mirror_ball", value_parser = outline, help_heading = "Mirror ball")]
    pub(super) ball: Option<String>,

    /// Reflectance of the ball, 0.01 to 1: a number or R,G,B
    #[arg(long, value_name = "R", default_value = "1", value_parser = reflectance, help_heading = "Mirror ball")]
    pub(super) ball_reflectance: String,

    /// Distance from the camera to the center of the ball, in radii [default: so far that it does not matter]
    #[arg(long, value_name = "D", requires = "mirror_ball", value_parser = above(1.01), help_heading = "Mirror ball")]
    pub(super) ball_distance: Option<f64>,

    /// Seed of the random numbers
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    pub(super) seed: u64,

    #[command(flatten)]
    #[serde(flatten)]
    pub(super) provider: ProviderFlags,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &[
        "scene",
        "gaussians",
        "capture",
        "at",
        "brackets",
        "mirror-ball",
        "picture",
        "provider",
        "output",
        "preview",
    ];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

fn rows(text: &str) -> Result<usize, String> {
    let rows = text.parse().ok().filter(|n| (16..=4096).contains(n));
    rows.ok_or_else(|| "expected rows from 16 to 4096".into())
}

/// A map and how it came to be.
pub(super) struct Estimate {
    pub(super) source: &'static str,
    pub(super) map: ImageF32,
    pub(super) axes: MapAxes,
    pub(super) coverage: f64,
    pub(super) clipped_share: f64,
    pub(super) clipped_factor: f64,
    pub(super) at: Option<[f64; 3]>,
    pub(super) place: Option<PlaceReport>,
    pub(super) brackets: Option<BracketReport>,
    pub(super) ball: Option<BallReport>,
    pub(super) provider: Option<ProviderUse>,
}

impl Estimate {
    /// A map of which nothing more is known.
    pub(super) fn new(source: &'static str, map: ImageF32, axes: MapAxes) -> Self {
        Self {
            source,
            map,
            axes,
            coverage: 0.0,
            clipped_share: 0.0,
            clipped_factor: 1.0,
            at: None,
            place: None,
            brackets: None,
            ball: None,
            provider: None,
        }
    }
}
