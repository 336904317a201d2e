//! Fewer triangles by quadric error (Garland & Heckbert 1997), by the library meshoptimizer.

use std::collections::BTreeMap;

use glam::Vec3;
use meshopt::{SimplifyOptions, VertexDataAdapter};
use motes_scene::Surface;

use super::MeshError;

/// A mesh whose vertices are some of a surface's.
#[derive(Clone, Debug, Default)]
pub(super) struct Reduced {
    /// Vertex of the surface per vertex.
    pub(super) rows: Vec<u32>,
    /// Positions of them.
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Estimated distance from the surface, world units.
    pub(super) error: f32,
}

/// Keeps at most about `most` triangles, all when that is 0. Triangles without area or with
/// corners that are not finite go.
pub(super) fn decimate(surface: &Surface, most: usize) -> Result<Reduced, MeshError> {
    let position = |v: u32| Vec3::from(surface.vertices[v as usize]);
    let has_area = |t: &&[u32; 3]| {
        let [a, b, c] = t.map(position);
        let cross = (b - a).as_dvec3().cross((c - a).as_dvec3()).length();
        cross > 0.0 && cross.is_finite()
    };
    let triangles: Vec<[u32; 3]> = surface.triangles.iter().filter(has_area).copied().collect();
    if triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    // Vertices of dropped triangles may be no numbers: only those in use are shown to the library.
    let compact = Reduced::of(surface, &triangles, 0.0);
    if most == 0 || triangles.len() <= most {
        return Ok(compact);
    }
    let bytes: Vec<u8> = compact.positions.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let Ok(adapter) = VertexDataAdapter::new(&bytes, 12, 0) else {
        return Ok(compact);
    };
    let indices: Vec<u32> = compact.triangles.iter().flatten().copied().collect();
    let mut error = 0.0;
    // The count decides; pieces smaller than the error may vanish.
    let options = SimplifyOptions::Prune | SimplifyOptions::ErrorAbsolute;
    let limit = f32::MAX;
    let kept = meshopt::simplify(&indices, &adapter, 3 * most, limit, options, Some(&mut error));
    let kept: Vec<[u32; 3]> = kept
        .as_chunks::<3>()
        .0
        .iter()
        .map(|t| t.map(|v| compact.rows[v as usize]))
        .filter(|t| has_area(&t))
        .collect();
    if kept.is_empty() { Ok(compact) } else { Ok(Reduced::of(surface, &kept, error)) }
}

impl Reduced {
    /// The vertices that `triangles` use, in order of first use.
    fn of(surface: &Surface, triangles: &[[u32; 3]], error: f32) -> Self {
        let mut numbers = BTreeMap::new();
        let mut reduced = Self { error, ..Self::default() };
        for t in triangles {
            let corners = t.map(|v| {
                *numbers.entry(v).or_insert_with(|| {
                    reduced.rows.push(v);
                    reduced.positions.push(surface.vertices[v as usize]);
                    reduced.rows.len() as u32 - 1
                })
            });
            reduced.triangles.push(corners);
        }
        reduced
    }
}
