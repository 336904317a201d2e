//! One way in for meshes: the format follows from the first bytes, and from the name where they say nothing.

use std::path::Path;

use glam::DVec3;
use motes_formats::error::Result;
use motes_formats::ply;

use crate::gltf;
use crate::mesh::{GRAY, Mesh, ROUGHNESS, add_creased_normals, read_obj};

/// Formats of meshes that can be read, for messages.
pub const MESH_FORMATS: &str = "PLY with faces (.ply), glTF (.glb, .gltf), Wavefront OBJ (.obj)";

/// How a mesh file starts or is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MeshFormat {
    Ply,
    Gltf,
    Obj,
}

/// Reads a mesh; `None` when the file is of another kind, such as Gaussians.
///
/// # Errors
/// The file cannot be read or is malformed.
pub fn open_mesh(path: &Path) -> Result<Option<Mesh>> {
    match format_of(path) {
        Some(MeshFormat::Ply) if ply::has_faces(path)? => read_ply(path).map(Some),
        Some(MeshFormat::Gltf) => gltf::read_mesh(path),
        Some(MeshFormat::Obj) => read_obj(path).map(Some),
        _ => Ok(None),
    }
}

/// By the first bytes, then by the name. What cannot be read is left to the reader to name.
fn format_of(path: &Path) -> Option<MeshFormat> {
    use std::io::Read as _;
    let mut start = Vec::with_capacity(4);
    std::fs::File::open(path).and_then(|file| file.take(4).read_to_end(&mut start)).ok()?;
    let suffix = path.extension().map(|s| s.to_ascii_lowercase());
    let named = |name: &str| suffix.as_ref().is_some_and(|s| s == name);
    match start.as_slice() {
        start if start.starts_with(b"ply") => Some(MeshFormat::Ply),
        b"glTF" => Some(MeshFormat::Gltf),
        _ if named("gltf") || named("glb") => Some(MeshFormat::Gltf),
        _ if named("obj") => Some(MeshFormat::Obj),
        _ => None,
    }
}

fn read_ply(path: &Path) -> Result<Mesh> {
    let mut surface = ply::read_mesh(path)?;
    let triangles = surface.triangles.len();
    if surface.normals.is_empty() {
        add_creased_normals(&mut surface, &mut [], &vec![false; triangles]);
    }
    if !surface.has_materials() {
        let n = surface.vertices.len();
        surface.base_color_linear = vec![GRAY; n];
        surface.roughness = vec![ROUGHNESS; n];
        surface.metallic = vec![0.0; n];
    }
    Ok(Mesh::plain(surface, DVec3::Z))
}

#[cfg(test)]
mod tests;
