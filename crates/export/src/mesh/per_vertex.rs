//! Without textures: colors at the vertices, and triangles grouped by what importers take from a
//! material alone, roughness and metallic.

use std::collections::BTreeMap;

use motes_scene::Surface;

use super::decimate::Reduced;
use super::{Look, MeshPart, PbrMesh};

/// Groups of roughness between 0 and 1: within a tenth of what the vertices say.
const STEPS: f32 = 5.0;

pub(super) fn per_vertex(surface: &Surface, reduced: &Reduced) -> PbrMesh {
    let unit = |v: f32| if v >= 0.0 { v.min(1.0) } else { 0.0 };
    let of = |values: &[f32]| -> Vec<f32> {
        reduced.rows.iter().map(|v| unit(values[*v as usize])).collect()
    };
    let triples = |values: &[[f32; 3]]| -> Vec<[f32; 3]> {
        reduced.rows.iter().map(|v| values[*v as usize]).collect()
    };
    let (roughness, metallic) = (of(&surface.roughness), of(&surface.metallic));
    let mean =
        |values: &[f32], t: &[u32; 3]| t.iter().map(|v| values[*v as usize]).sum::<f32>() / 3.0;
    let mut groups: BTreeMap<(bool, u32), (MeshPart, f32, f32)> = BTreeMap::new();
    for t in &reduced.triangles {
        let (r, m) = (mean(&roughness, t), mean(&metallic, t));
        let (part, sum_r, sum_m) = groups.entry((m >= 0.5, (r * STEPS) as u32)).or_default();
        part.triangles.push(*t);
        *sum_r += r;
        *sum_m += m;
    }
    let parts = groups
        .into_values()
        .map(|(part, sum_r, sum_m)| {
            let n = part.triangles.len().max(1) as f32;
            MeshPart { roughness: unit(sum_r / n), metallic: unit(sum_m / n), ..part }
        })
        .collect();
    let normals = triples(&surface.normals)
        .into_iter()
        .map(|n| glam::Vec3::from(n).normalize_or(glam::Vec3::Z).to_array())
        .collect();
    let base = triples(&surface.base_color_linear).into_iter().map(|c| c.map(unit)).collect();
    PbrMesh {
        positions: reduced.positions.clone(),
        normals,
        parts,
        look: Look::Vertices { base_color_linear: base, roughness, metallic },
        ..PbrMesh::default()
    }
}
