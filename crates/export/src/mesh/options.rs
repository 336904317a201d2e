//! Size of a mesh, and the program that it is for.

use clap::{Args, ValueEnum};
use serde::Serialize;

/// How fine the mesh is.
#[derive(Args, Clone, Copy, Debug, PartialEq, Serialize)]
#[command(next_help_heading = "Mesh")]
pub struct MeshOptions {
    /// Number of triangles after simplification; 0 keeps all
    #[arg(long, value_name = "N", default_value_t = 40_000)]
    pub triangles: usize,

    /// Side of the square textures in pixels, 64 to 8192
    #[arg(long, value_name = "PX", default_value_t = 2048,
        value_parser = clap::value_parser!(u32).range(64..=8192))]
    pub texture_size: u32,

    /// Vertex colors and one material per material class, instead of textures
    #[arg(long)]
    pub no_atlas: bool,
}

impl Default for MeshOptions {
    fn default() -> Self {
        Self { triangles: 40_000, texture_size: 2048, no_atlas: false }
    }
}

/// Who opens the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Target {
    /// Blender, Cycles, Eevee
    #[default]
    Blender,
    /// Unreal Engine (Interchange importer)
    Unreal,
    /// three.js and other web viewers
    Threejs,
    /// OpenUSD tools (through their glTF plug-in)
    Usd,
}
