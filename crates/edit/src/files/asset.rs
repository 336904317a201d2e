//! What is inserted: splats, scene folders, meshes.

use glam::DVec3;
use motes_codecs::{MESH_FORMATS, open_gaussians, open_mesh};
use motes_formats::FormatError;
use motes_formats::decomposition::read_decomposition;
use motes_formats::ply::read_surface;

use crate::changes::insert::Asset;
use crate::changes::materials::material_named;
use crate::changes::mesh::gaussians_on;
use crate::run::{EditError, Resources, Wanted};

impl Resources<'_> {
    /// What an operation inserts; `at` is the pointer of the operation.
    pub(crate) fn asset(&self, wanted: &Wanted<'_>, at: &str) -> Result<Asset, EditError> {
        let path = self.file(wanted.file);
        let failed = EditError::file(at);
        let (gaussians, surface, own_up, mesh) = if path.is_dir() {
            let decomposition = read_decomposition(&path).map_err(&failed)?;
            let gaussians = open_gaussians(&decomposition.gaussians).map_err(&failed)?.gaussians;
            let surface = read_surface(&decomposition.surface).map_err(&failed)?;
            let up = DVec3::from_array(decomposition.document.up_in_world);
            (gaussians, Some(surface).filter(|s| !s.triangles.is_empty()), Some(up), None)
        } else if let Some(mesh) = open_mesh(&path).map_err(&failed)? {
            let gaussians = gaussians_on(&mesh, wanted.count.map(|n| n as usize));
            (gaussians, Some(mesh.baked_surface()), Some(mesh.up), Some(mesh))
        } else {
            let gaussians = open_gaussians(&path).map_err(|error| failed(known_kinds(error)))?;
            (gaussians.gaussians, None, None, None)
        };
        let up =
            wanted.up.map(DVec3::from_array).or(own_up).unwrap_or(DVec3::Z).normalize_or(DVec3::Z);
        let name = wanted.file.to_owned();
        let mut asset = Asset { name, gaussians, surface, mesh, pixel: 0.0, up };
        if let Some(material) = wanted.material.and_then(material_named) {
            asset.make_of(material);
        }
        if asset.is_nowhere() {
            let cause = "there is nothing with a place in it";
            return Err(EditError::plan(format!("{at}/file"), cause));
        }
        Ok(asset)
    }
}

/// What is no known format of Gaussians may have been meant as a mesh.
fn known_kinds(error: FormatError) -> FormatError {
    let is_unknown = matches!(&error, FormatError::NotSupported { place, .. } if place == "byte 0");
    if !is_unknown {
        return error;
    }
    error.with_remedy(format!(
        "what can be inserted: meshes as {MESH_FORMATS}; Gaussians in any format that export reads; scene folders"
    ))
}
