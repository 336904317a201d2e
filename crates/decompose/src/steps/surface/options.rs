//! Options of the extraction of a surface.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How a surface is extracted.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[group(skip)]
pub struct Options {
    /// Edge of a voxel in pixels at the median depth of the photos; smaller is finer and slower
    #[arg(long, help_heading = "Geometry", default_value_t = 1.5, value_name = "PIXELS")]
    pub voxel_pixels: f32,
    /// Blocks of 8x8x8 voxels (4 KiB each) at most; more make the voxels larger
    #[arg(long, help_heading = "Geometry", default_value_t = 100_000, value_name = "COUNT")]
    pub max_blocks: usize,
    /// Pieces of surface smaller than the square of this many voxels are dropped
    #[arg(long, help_heading = "Geometry", default_value_t = 20.0, value_name = "VOXELS")]
    pub min_component: f32,
    /// Views that must have seen a piece of surface; fewer photos lower it
    #[arg(long, help_heading = "Geometry", default_value_t = 3, value_name = "COUNT")]
    pub min_views: u8,
    /// Share of the surface from which a plane is taken for one (a table, a floor); above 1: never
    #[arg(long, help_heading = "Geometry", default_value_t = 0.15, value_name = "SHARE")]
    pub plane_share: f32,
    /// Distance from a plane up to which the surface is put onto it
    #[arg(long, help_heading = "Geometry", default_value_t = 2.5, value_name = "VOXELS")]
    pub plane_tolerance: f32,
    /// Flat faces of things at least this wide are put onto their planes; larger than any: never
    #[arg(long, help_heading = "Geometry", default_value_t = 20.0, value_name = "VOXELS")]
    pub facet_width: f32,
    /// Stiffness of the surface against the noise of the Gaussians' depth; 0 leaves it as fused
    #[arg(long, help_heading = "Geometry", default_value_t = 100.0, value_name = "WEIGHT")]
    pub stiffness: f32,
    /// Times that the normal of every vertex is averaged with its neighbors' in the end
    #[arg(long, help_heading = "Geometry", default_value_t = 0, value_name = "COUNT")]
    pub smooth_normals: usize,
    /// Weight of a view that looks through a place against one that sees surface there
    #[arg(long, help_heading = "Geometry", default_value_t = 0.25, value_name = "WEIGHT")]
    pub carve_weight: f32,
    /// Averages that make the rest curvature
    #[arg(long, help_heading = "Geometry", default_value_t = 30, value_name = "COUNT")]
    pub rest_passes: usize,
    /// Depth is read where the transmittance to this power passes 1/2: 1 is the median, more is nearer the front
    #[arg(long, help_heading = "Geometry", default_value_t = 10.0, value_name = "FACTOR")]
    pub front_power: f32,
    /// Rounds of moving the surface to where the photos agree; 0 leaves it where the Gaussians put it
    #[arg(long, help_heading = "Geometry", default_value_t = 3, value_name = "COUNT")]
    pub refine_rounds: usize,
    /// Farthest that the first round moves the surface; each later one 0.6 of the one before
    #[arg(long, help_heading = "Geometry", default_value_t = 5.0, value_name = "VOXELS")]
    pub refine_range: f32,
    /// Stiffness of the surface while the photos move it
    #[arg(long, help_heading = "Geometry", default_value_t = 300.0, value_name = "WEIGHT")]
    pub refine_stiffness: f32,
    /// Distance of the samples of a patch that photos are compared by
    #[arg(long, help_heading = "Geometry", default_value_t = 1.0, value_name = "VOXELS")]
    pub patch_spacing: f32,
    /// Weight of the outlines of things in the photos against their agreement; 0 leaves outlines out
    #[arg(long, help_heading = "Geometry", default_value_t = 0.5, value_name = "WEIGHT")]
    pub outline_weight: f32,
    /// Difference of brightness between photos (0 to 1, as it is seen) from which a piece of surface counts as one that mirrors, about
    /// whose place the photos' agreement tells nothing; 0 leaves this out
    #[arg(long, help_heading = "Geometry", default_value_t = 0.08, value_name = "BRIGHTNESS")]
    pub mirror_spread: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
