//! What is inserted: splats, scene folders, meshes.

use std::io::Read as _;
use std::path::Path;

use glam::DVec3;
use motes_codecs::open_gaussians;
use motes_formats::decomposition::read_decomposition;
use motes_formats::ply::{has_faces, read_mesh, read_surface};
use motes_scene::{Materials, Surface};

use super::context::EditError;
use crate::changes::insert::{Asset, guessed_materials};
use crate::changes::materials::{LibraryMaterial, material_named};
use crate::changes::mesh::gaussians_on;

/// What an operation says about an asset.
pub(crate) struct AssetRequest<'a> {
    pub(crate) path: &'a Path,
    pub(crate) name: &'a str,
    pub(crate) up: Option<[f64; 3]>,
    /// Gaussians that a mesh becomes.
    pub(crate) count: Option<u64>,
    pub(crate) material: Option<&'a str>,
}

/// Reads an asset.
pub(crate) fn load_asset(request: &AssetRequest<'_>, at: &str) -> Result<Asset, EditError> {
    let failed = EditError::file(at);
    let (gaussians, surface, own_up) = if request.path.is_dir() {
        let decomposition = read_decomposition(request.path).map_err(&failed)?;
        let gaussians = open_gaussians(&decomposition.gaussians).map_err(&failed)?.gaussians;
        let surface = read_surface(&decomposition.surface).map_err(&failed)?;
        let up = DVec3::from_array(decomposition.document.up_in_world);
        (gaussians, Some(surface).filter(|s| !s.triangles.is_empty()), Some(up))
    } else if is_ply(request.path) && has_faces(request.path).map_err(&failed)? {
        let mut mesh = read_mesh(request.path).map_err(&failed)?;
        if !mesh.has_materials() {
            give_material(&mut mesh, [0.5; 3], 0.6, 0.0);
        }
        let gaussians = gaussians_on(&mesh, request.count.map(|n| n as usize));
        (gaussians, Some(mesh), None)
    } else {
        (open_gaussians(request.path).map_err(&failed)?.gaussians, None, None)
    };
    let up =
        request.up.map(DVec3::from_array).or(own_up).unwrap_or(DVec3::Z).normalize_or(DVec3::Z);
    let mut asset = Asset { name: request.name.to_owned(), gaussians, surface, up };
    if let Some(material) = request.material.and_then(material_named) {
        make_of(&mut asset, material);
    }
    if asset.is_nowhere() {
        let cause = "there is nothing with a place in it";
        return Err(EditError::plan(format!("{at}/file"), cause));
    }
    Ok(asset)
}

/// Whether a file says that it is PLY; other codecs of Gaussians have no faces. What cannot be read is left to the reader to name.
fn is_ply(path: &Path) -> bool {
    let mut start = Vec::with_capacity(4);
    let read = std::fs::File::open(path).and_then(|file| file.take(3).read_to_end(&mut start));
    read.is_ok() && start == *b"ply"
}

fn give_material(mesh: &mut Surface, base: [f32; 3], roughness: f32, metallic: f32) {
    let n = mesh.vertices.len();
    mesh.base_color_linear = vec![base; n];
    mesh.roughness = vec![roughness; n];
    mesh.metallic = vec![metallic; n];
}

/// All of one material of the library.
fn make_of(asset: &mut Asset, material: &LibraryMaterial) {
    let mut materials =
        Materials::of(&asset.gaussians).unwrap_or_else(|_| guessed_materials(&asset.gaussians));
    let base = material.base_color_linear;
    materials.base_color_linear.fill(base);
    materials.roughness.fill(material.roughness);
    materials.metallic.fill(material.metallic);
    materials.attach(&mut asset.gaussians);
    if let Some(surface) = &mut asset.surface {
        give_material(surface, base, material.roughness, material.metallic);
    }
    let stride = 3 * asset.gaussians.sh_coefficients();
    for sh in asset.gaussians.sh.chunks_exact_mut(stride) {
        crate::changes::color::show_linear(sh, base);
    }
}
