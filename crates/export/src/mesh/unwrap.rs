//! Charts of an atlas, by the library uvunwrap: planar and least squares conformal charts, packed.

use motes_scene::Surface;
use uvunwrap::{Density, MeshInput, Options, Packing};

use super::MeshError;
use super::decimate::Reduced;
use super::tangents::split_by_tangent;

/// Empty texels round each chart: the second mip level still keeps charts apart.
const PADDING: u32 = 2;

/// A mesh whose vertices are split where charts meet.
pub(super) struct Atlas {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) charts: u32,
    pub(super) utilization: f32,
    /// Side of a texel, world units.
    pub(super) texel: f32,
    /// Vertex of the surface per vertex.
    pub(super) rows: Vec<u32>,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) uvs: Vec<[f32; 2]>,
    pub(super) tangents: Vec<[f32; 4]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Cuts the mesh into charts on one page of `size` texels.
pub(super) fn unwrap(surface: &Surface, reduced: &Reduced, size: u32) -> Result<Atlas, MeshError> {
    let indices: Vec<u32> = reduced.triangles.iter().flatten().copied().collect();
    let options = Options {
        density: Density::Auto { page_size: size },
        padding: PADDING,
        packing: Packing::Fast,
        ..Options::default()
    };
    let atlas = uvunwrap::generate(&[MeshInput::new(&reduced.positions, &indices)], &options)
        .map_err(|error| MeshError::Atlas(error.to_string()))?;
    if atlas.page_count > 1 {
        return Err(MeshError::Atlas(format!(
            "{} charts do not fit on one page of {size} pixels",
            atlas.chart_count
        )));
    }
    let (width, height) = (atlas.width as usize, atlas.height as usize);
    let (charts, utilization) = (atlas.chart_count, atlas.utilization);
    let texel = 1.0 / atlas.texels_per_unit;
    let mesh = atlas.meshes.into_iter().next().unwrap_or_default();
    let rows: Vec<u32> = mesh.vertices.iter().map(|v| reduced.rows[v.xref as usize]).collect();
    let of = |values: &[[f32; 3]]| -> Vec<[f32; 3]> {
        rows.iter().map(|v| values[*v as usize]).collect()
    };
    let (positions, normals) = (of(&surface.vertices), of(&surface.normals));
    let uvs = mesh.vertices.iter().map(|v| v.uv).collect();
    let triangles = mesh.indices.as_chunks::<3>().0.to_vec();
    let atlas = Atlas {
        width,
        height,
        charts,
        utilization,
        texel,
        rows,
        positions,
        normals,
        uvs,
        tangents: Vec::new(),
        triangles,
    };
    Ok(split_by_tangent(atlas))
}
