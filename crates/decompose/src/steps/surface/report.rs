//! What the extraction of a surface did.

use serde::{Deserialize, Serialize};

/// Seconds of one step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepTime {
    /// Its name.
    pub name: String,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// What the extraction of a surface did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GeometryReport {
    /// Edge of a voxel, world units; 0 when there is no surface.
    pub voxel: f64,
    /// Triangles of the surface.
    pub triangles: usize,
    /// Small pieces that were dropped.
    pub pieces_dropped: usize,
    /// Share of the pixels without texture, whose depth follows from what is around them.
    #[serde(default)]
    pub untextured: f64,
    /// Dominant planes that the photos know for flat,
    pub planes: usize,
    /// of those that fit the depth.
    #[serde(default)]
    pub planes_found: usize,
    /// Planes that bound the scene: walls, floors.
    #[serde(default)]
    pub walls: usize,
    /// Planar faces of objects that were found.
    #[serde(default, alias = "facets")]
    pub planar_faces: usize,
    /// Share of the pixels that see planes or walls.
    pub pixels_on_planes: f64,
    /// Blocks of voxels.
    pub blocks: usize,
    /// Mean agreement of the photos about the surface before each round of refinement, -1 to 1.
    pub agreement: Vec<f64>,
    /// Time per step.
    pub steps: Vec<StepTime>,
}
