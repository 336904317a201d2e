//! Materials of parts at the vertices of the surface.

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::material::{FoundMaterials, Kind, PartMaterial};
use crate::observation::{Sample, TracedSurface};

/// Roughness and metallic at the vertices of the surface.
#[derive(Clone, Debug, Default)]
pub struct VertexMaterials {
    /// Perceptual; 1 with `specular` 0.
    pub roughness: Vec<f32>,
    /// 0 to 1.
    pub metallic: Vec<f32>,
    /// 0 where there is no specular lobe, else 1.
    pub specular: Vec<f32>,
    /// Base color of the whole part, where it is to have one.
    pub part_color_linear: Vec<Vec3>,
    /// 1 there, else 0.
    pub is_uniform: Vec<f32>,
    /// Index of the part.
    pub part: Vec<u32>,
}

/// Material of every vertex: that of the nearest sample.
pub(crate) fn vertex_materials(
    scene: &TracedSurface,
    samples: &[Sample],
    found: &FoundMaterials,
) -> VertexMaterials {
    // Points of planes and of things that stand on them are looked up apart, so that no table runs up a vase.
    let flat: Vec<bool> = samples.iter().map(|s| s.sheet != 0).collect();
    let positions = |want: bool| -> (Vec<[f32; 3]>, Vec<u32>) {
        (0..samples.len())
            .filter(|&p| flat[p] == want)
            .map(|p| (samples[p].position.to_array(), found.of_sample[p]))
            .unzip()
    };
    let trees = [false, true].map(|want| {
        let (positions, parts) = positions(want);
        (ImmutableKdTree::<f32, 3>::new_from_slice(&positions).ok(), parts)
    });
    let mut of_piece = vec![false; scene.surface.vertices.len()];
    for (t, sheet) in scene.surface.triangles.iter().zip(&scene.sheets) {
        t.iter().for_each(|&v| of_piece[v as usize] = *sheet != 0);
    }
    let part_of: Vec<u32> = (0..scene.surface.vertices.len())
        .into_par_iter()
        .map(|v| {
            let own = usize::from(of_piece[v]);
            [own, 1 - own]
                .into_iter()
                .find_map(|k| {
                    let (tree, parts) = &trees[k];
                    let found = tree
                        .as_ref()?
                        .query(&scene.surface.vertices[v])
                        .nearest_one::<SquaredEuclidean<f32>>()
                        .execute();
                    parts.get(found.item as usize)
                })
                .copied()
                .unwrap_or(0)
        })
        .collect();
    let parts: Vec<PartMaterial> = part_of.iter().map(|&p| found.parts[p as usize]).collect();
    VertexMaterials {
        roughness: parts.iter().map(|p| p.roughness).collect(),
        metallic: parts.iter().map(|p| f32::from(u8::from(p.kind == Kind::Metal))).collect(),
        part_color_linear: parts
            .iter()
            .map(|p| p.metal_color_linear.unwrap_or(Vec3::ZERO))
            .collect(),
        is_uniform: parts
            .iter()
            .map(|p| f32::from(u8::from(p.metal_color_linear.is_some())))
            .collect(),
        specular: parts.iter().map(|p| f32::from(u8::from(p.kind != Kind::Matte))).collect(),
        part: part_of,
    }
}
