//! Options of the extraction of a surface.

use clap::Args;
use serde::{Deserialize, Serialize};

/// How a surface is extracted.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[group(skip)]
#[command(next_help_heading = "Surface reconstruction (expert)")]
pub struct Options {
    /// Edge of a voxel in pixels at the median depth of the photos; smaller is finer and slower. Capped at 1/200 of the
    /// longer side of the photos or at one pixel, whichever is larger
    #[arg(long, default_value_t = 2.0, value_name = "PIXELS")]
    pub voxel_pixels: f32,
    /// Maximum number of blocks of 8x8x8 voxels (1.5 KiB each); larger scenes get larger voxels
    #[arg(long, default_value_t = 100_000, value_name = "COUNT")]
    pub max_blocks: usize,
    /// Connected components smaller than the square of this many voxels are removed
    #[arg(long, default_value_t = 20.0, value_name = "VOXELS")]
    pub min_component: f32,
    /// Views that must have seen a part of the surface; few photos lower it
    #[arg(long, default_value_t = 3, value_name = "COUNT")]
    pub min_views: u8,
    /// Smallest fraction of the surface that counts as a plane (a table, a floor); above 1 disables
    /// planes
    #[arg(long, default_value_t = 0.15, value_name = "SHARE")]
    pub plane_share: f32,
    /// Smallest fraction of all pixels that must show a bare wall or floor behind everything else; above 1 disables walls
    #[arg(long, default_value_t = 0.01, value_name = "SHARE")]
    pub wall_share: f32,
    /// Surface closer to a plane than this is projected onto it
    #[arg(long, default_value_t = 2.5, value_name = "VOXELS")]
    pub plane_tolerance: f32,
    /// Planar faces of objects at least this wide are projected onto their planes
    #[arg(long, alias = "facet-width", default_value_t = 20.0, value_name = "VOXELS")]
    #[serde(alias = "facet-width")]
    pub planar_face_width: f32,
    /// Stiffness of the surface against noise in the Gaussians' depth; 0 keeps the fused surface
    #[arg(long, default_value_t = 100.0, value_name = "WEIGHT")]
    pub stiffness: f32,
    /// Final smoothing iterations of the vertex normals
    #[arg(long, default_value_t = 0, value_name = "COUNT")]
    pub smooth_normals: usize,
    /// Weight of a view that sees through a voxel, against one that sees surface there
    #[arg(long, default_value_t = 0.25, value_name = "WEIGHT")]
    pub carve_weight: f32,
    /// Smoothing iterations that define the rest curvature
    #[arg(long, default_value_t = 30, value_name = "COUNT")]
    pub rest_passes: usize,
    /// Depth is read where the transmittance to this power passes 1/2: 1 is the median, larger
    /// values are closer to the front
    #[arg(long, default_value_t = 4.0, value_name = "FACTOR")]
    pub front_power: f32,
    /// Length over which depth is smoothed where the photos have no texture, as a share of their longer side; 0 keeps the
    /// depth of the Gaussians
    #[arg(long, default_value_t = 0.06, value_name = "SHARE")]
    pub smooth_untextured: f32,
    /// Rounds of photo-consistent refinement of the surface; 0 keeps the surface of the Gaussians
    #[arg(long, default_value_t = 3, value_name = "COUNT")]
    pub refine_rounds: usize,
    /// Search range of the first refinement round; each later one has 0.6 of the previous
    #[arg(long, default_value_t = 5.0, value_name = "VOXELS")]
    pub refine_range: f32,
    /// Stiffness of the surface during refinement
    #[arg(long, default_value_t = 300.0, value_name = "WEIGHT")]
    pub refine_stiffness: f32,
    /// Distance between the samples of a photo-consistency patch
    #[arg(long, default_value_t = 1.0, value_name = "VOXELS")]
    pub patch_spacing: f32,
    /// Weight of silhouettes against photo-consistency; 0 disables them
    #[arg(long, default_value_t = 0.5, value_name = "WEIGHT")]
    pub outline_weight: f32,
    /// Brightness difference between photos (0 to 1, sRGB-encoded) from which a part of the surface
    /// counts as mirror-like, where photo-consistency is ignored; 0 disables it
    #[arg(long, default_value_t = 0.08, value_name = "BRIGHTNESS")]
    pub mirror_spread: f32,
}

impl Default for Options {
    fn default() -> Self {
        crate::appearance::options::defaults()
    }
}
