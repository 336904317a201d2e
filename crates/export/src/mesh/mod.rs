//! A decomposed scene as a mesh with textures that renderers light: one `.glb`.
//!
//! Steps: the surface is decimated (`decimate`), cut into charts of an atlas (`unwrap`), and every texel
//! takes what a viewer above it would see: base color, roughness, metallic and visibility of the
//! Gaussians (`gaussians_at`), the normal of the full surface (`texels`). `glb` writes the file,
//! [`target`] says in which axes, [`environment`] turns the light with it.
//!
//! `docs/methods/export.md` says what is approximated, `docs/benchmarks/export.md` what it costs and how
//! it compares in Blender.

mod bake;
mod decimate;
pub mod environment;
mod fill;
mod gaussians_at;
pub(crate) mod glb;
mod options;
mod per_vertex;
mod tangents;
pub mod target;
mod texels;
mod unwrap;

#[cfg(test)]
mod tests;

use motes_scene::{Gaussians, ImageU8, Materials, Surface};
pub use options::{MeshOptions, Target};
use serde::Serialize;
use thiserror::Error;

pub use glb::write_glb;

/// Why there is no mesh.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MeshError {
    /// Nothing to draw.
    #[error("the surface has no triangles with an area")]
    Empty,
    /// Arrays of different lengths, or corners that do not exist.
    #[error("the arrays of the surface do not belong together")]
    Inconsistent,
    /// No base color, roughness and metallic at the vertices.
    #[error("the vertices of the surface have no base_color, roughness and metallic")]
    NoMaterials,
    /// The surface cannot be flattened.
    #[error("the surface cannot be cut into an atlas: {0}")]
    Atlas(String),
}

/// A mesh as renderers take it, in the axes of the world; `V` vertices.
#[derive(Clone, Debug, Default)]
pub struct PbrMesh {
    /// `[V]`, world units.
    pub positions: Vec<[f32; 3]>,
    /// `[V]`, unit, out of the matter.
    pub normals: Vec<[f32; 3]>,
    /// Parts with a material each.
    pub parts: Vec<MeshPart>,
    /// Textures, or colors at the vertices.
    pub look: Look,
    /// Whether the matter has no coat: `KHR_materials_specular` with factor 0.
    pub is_lambert: bool,
    /// What happened on the way.
    pub summary: MeshSummary,
}

/// Triangles of one material.
#[derive(Clone, Debug, Default)]
pub struct MeshPart {
    /// `[T]`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Factor on the roughness; the value itself without textures.
    pub roughness: f32,
    /// Likewise.
    pub metallic: f32,
}

/// Where color comes from.
#[derive(Clone, Debug)]
pub enum Look {
    /// Colors at the vertices.
    Vertices {
        /// `[V]`, linear, Rec. 709.
        base_color_linear: Vec<[f32; 3]>,
        /// `[V]`, as the attribute `_ROUGHNESS`.
        roughness: Vec<f32>,
        /// `[V]`, as the attribute `_METALLIC`.
        metallic: Vec<f32>,
    },
    /// Textures of one atlas.
    Textures(Box<Textures>),
}

impl Default for Look {
    fn default() -> Self {
        Self::Vertices {
            base_color_linear: Vec::new(),
            roughness: Vec::new(),
            metallic: Vec::new(),
        }
    }
}

/// An atlas with its pictures.
#[derive(Clone, Debug)]
pub struct Textures {
    /// `[V]`, from the top left corner, 0 to 1.
    pub uvs: Vec<[f32; 2]>,
    /// `[V]`, unit, and the sign of the bitangent; by MikkTSpace with v upwards.
    pub tangents: Vec<[f32; 4]>,
    /// sRGB-encoded.
    pub base_color: ImageU8,
    /// Occlusion, roughness, metallic.
    pub orm: ImageU8,
    /// Tangent space, +x along u, +y up in the picture.
    pub normal: ImageU8,
}

/// What happened on the way to a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeshSummary {
    /// Triangles of the surface.
    pub triangles_of_surface: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Largest distance that decimation moved the surface by, world units, as it estimates it.
    pub decimation_error: f32,
    /// Pieces of the atlas.
    pub charts: u32,
    /// Share of the texels that shows surface.
    pub utilization: f32,
    /// Side of a texel, world units.
    pub texel: f32,
    /// Share of the texels that took their material from Gaussians; the others from the surface.
    pub from_gaussians: f32,
}

/// What a mesh is made of.
#[derive(Clone, Copy, Debug)]
pub struct MeshSource<'a> {
    /// With materials.
    pub surface: &'a Surface,
    /// Where detail comes from, with their materials; `None` takes everything from the surface.
    pub gaussians: Option<(&'a Gaussians, &'a Materials)>,
    /// Whether the matter has no coat.
    pub is_lambert: bool,
}

impl MeshSource<'_> {
    /// Decimates, unwraps and bakes. The same mesh at any number of threads.
    ///
    /// # Errors
    /// When the surface is empty, inconsistent, without material, or cannot be unwrapped.
    pub fn mesh(&self, options: &MeshOptions) -> Result<PbrMesh, MeshError> {
        let surface = self.surface;
        if !surface.is_consistent() {
            return Err(MeshError::Inconsistent);
        }
        let reduced = decimate::decimate(surface, options.triangles)?;
        if !surface.has_materials() {
            return Err(MeshError::NoMaterials);
        }
        let mut mesh = if options.no_atlas {
            per_vertex::per_vertex(surface, &reduced)
        } else {
            let atlas = unwrap::unwrap(surface, &reduced, options.texture_size)?;
            bake::bake(self, &reduced, &atlas)
        };
        mesh.is_lambert = self.is_lambert;
        mesh.summary.triangles_of_surface = surface.triangles.len();
        mesh.summary.triangles = mesh.parts.iter().map(|p| p.triangles.len()).sum();
        mesh.summary.vertices = mesh.positions.len();
        mesh.summary.decimation_error = reduced.error;
        Ok(mesh)
    }
}
