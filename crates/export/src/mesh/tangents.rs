//! Tangents as every reader of a normal texture computes them (Mikkelsen 2008), so that what is
//! baked is what is read.

use std::collections::BTreeMap;

use glam::Vec3;
use meshopt::TangentOptions;

use super::unwrap::Atlas;

/// Gives every corner its tangent; vertices whose corners disagree become several.
pub(super) fn split_by_tangent(mut atlas: Atlas) -> Atlas {
    let normals: Vec<[f32; 3]> =
        atlas.normals.iter().map(|n| Vec3::from(*n).normalize_or(Vec3::Z).to_array()).collect();
    // Pictures have v downwards, tangent space has it upwards.
    let uvs: Vec<[f32; 2]> = atlas.uvs.iter().map(|[u, v]| [*u, 1.0 - v]).collect();
    let indices: Vec<u32> = atlas.triangles.iter().flatten().copied().collect();
    let tangents = meshopt::generate_tangents(
        Some(&indices),
        &atlas.positions,
        &normals,
        &uvs,
        TangentOptions::Compatible,
    );
    let mut numbers = BTreeMap::new();
    let (mut of_vertex, mut of_corner) = (Vec::new(), Vec::new());
    let corners: Vec<u32> = indices
        .iter()
        .zip(&tangents)
        .map(|(vertex, tangent)| {
            *numbers.entry((*vertex, tangent.map(f32::to_bits))).or_insert_with(|| {
                of_vertex.push(*vertex as usize);
                of_corner.push(*tangent);
                of_vertex.len() as u32 - 1
            })
        })
        .collect();
    atlas.rows = of_vertex.iter().map(|v| atlas.rows[*v]).collect();
    atlas.positions = of_vertex.iter().map(|v| atlas.positions[*v]).collect();
    atlas.uvs = of_vertex.iter().map(|v| atlas.uvs[*v]).collect();
    atlas.normals = of_vertex.iter().map(|v| normals[*v]).collect();
    atlas.tangents = of_vertex
        .iter()
        .zip(of_corner)
        .map(|(v, tangent)| unit_tangent(tangent, Vec3::from(normals[*v])))
        .collect();
    atlas.triangles = corners.as_chunks::<3>().0.to_vec();
    atlas
}

/// Unit and with a sign of one, whatever a degenerate chart gave.
fn unit_tangent([x, y, z, w]: [f32; 4], normal: Vec3) -> [f32; 4] {
    let t = Vec3::new(x, y, z).try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
    [t.x, t.y, t.z, if w < 0.0 { -1.0 } else { 1.0 }]
}
