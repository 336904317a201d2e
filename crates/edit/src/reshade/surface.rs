//! The mesh that rays meet, after its matter was moved, doubled or taken away.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use motes_scene::Surface;

use super::images::Images;
use crate::{AT_REST, Similarity};

/// Triangles with corners in the images that all three share, without those at rest whose corners are all `dropped`. Vertices keep their numbers, unused ones
/// too, because random directions are keyed by them; [`compacted`] drops those.
pub(super) fn moved(
    surface: &Surface,
    images: &Images,
    fate_of_vertex: &[u32],
    motions: &[Similarity],
    dropped: impl Fn(u32) -> bool,
) -> Surface {
    let mut out =
        Surface { triangles: Vec::with_capacity(surface.triangles.len()), ..surface.clone() };
    let mut copies: HashMap<(u32, u32), u32> = HashMap::new();
    for corners in &surface.triangles {
        let [a, b, c] = corners.map(|v| &images.fate(fate_of_vertex[v as usize]).motions);
        for &motion in a.iter().filter(|m| b.contains(m) && c.contains(m)) {
            if motion == AT_REST {
                if !corners.iter().all(|v| dropped(*v)) {
                    out.triangles.push(*corners);
                }
                continue;
            }
            let triangle = corners.map(|v| {
                *copies
                    .entry((motion, v))
                    .or_insert_with(|| push_copy(&mut out, v as usize, &motions[motion as usize]))
            });
            out.triangles.push(triangle);
        }
    }
    out
}

fn push_copy(surface: &mut Surface, v: usize, motion: &Similarity) -> u32 {
    let wide = |x: [f32; 3]| Vec3::from(x).as_dvec3();
    let narrow = |x: DVec3| x.as_vec3().to_array();
    let position = motion.point(wide(surface.vertices[v]));
    let normal = motion.direction(wide(surface.normals[v]));
    surface.vertices.push(narrow(position));
    surface.normals.push(narrow(normal));
    if v < surface.base_color_linear.len() {
        surface.base_color_linear.push(surface.base_color_linear[v]);
        surface.roughness.push(surface.roughness[v]);
        surface.metallic.push(surface.metallic[v]);
    }
    if let Some(emission) = surface.emission(v) {
        surface.emission_linear.resize(surface.vertices.len(), [0.0; 3]);
        surface.emission_linear[surface.vertices.len() - 1] = emission;
    }
    surface.vertices.len() as u32 - 1
}

/// Adds the vertices and triangles of `part`, which must have materials like the surface, unless it is empty.
pub(super) fn append(surface: &mut Surface, part: &Surface) {
    if part.triangles.is_empty() {
        return;
    }
    if surface.triangles.is_empty() && !surface.has_materials() {
        *surface = part.clone();
        return;
    }
    let first = surface.vertices.len() as u32;
    surface.vertices.extend(&part.vertices);
    surface.normals.extend(&part.normals);
    surface.triangles.extend(part.triangles.iter().map(|t| t.map(|v| first + v)));
    let n = part.vertices.len();
    if part.shines() {
        surface.emission_linear.resize(first as usize, [0.0; 3]);
        surface.emission_linear.extend(&part.emission_linear);
    }
    if part.has_materials() {
        surface.base_color_linear.extend(&part.base_color_linear);
        surface.roughness.extend(&part.roughness);
        surface.metallic.extend(&part.metallic);
    } else {
        // What is not known reflects as matter in general does.
        surface.base_color_linear.extend(vec![[0.35; 3]; n]);
        surface.roughness.extend(vec![0.6; n]);
        surface.metallic.extend(vec![0.0; n]);
    }
}

/// Without vertices that no triangle uses.
pub(super) fn compacted(surface: &Surface) -> Surface {
    const UNUSED: u32 = u32::MAX;
    let mut number = vec![UNUSED; surface.vertices.len()];
    surface.triangles.iter().flatten().for_each(|v| number[*v as usize] = 0);
    let kept: Vec<usize> = (0..number.len()).filter(|&v| number[v] != UNUSED).collect();
    kept.iter().enumerate().for_each(|(new, old)| number[*old] = new as u32);
    fn pick<T: Copy>(values: &[T], kept: &[usize]) -> Vec<T> {
        if values.is_empty() { Vec::new() } else { kept.iter().map(|&v| values[v]).collect() }
    }
    Surface {
        vertices: pick(&surface.vertices, &kept),
        normals: pick(&surface.normals, &kept),
        triangles: surface.triangles.iter().map(|t| t.map(|v| number[v as usize])).collect(),
        base_color_linear: pick(&surface.base_color_linear, &kept),
        roughness: pick(&surface.roughness, &kept),
        metallic: pick(&surface.metallic, &kept),
        emission_linear: if surface.shines() {
            kept.iter().map(|&v| surface.emission(v).unwrap_or_default()).collect()
        } else {
            Vec::new()
        },
    }
}
