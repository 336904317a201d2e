//! Normals of meshes that bring none.

use std::collections::HashMap;

use glam::Vec3;
use motes_scene::Surface;

/// Faces that meet at a smaller angle are one smooth surface: 30 degrees, the default of Blender's "shade auto smooth".
const SMOOTH_COSINE: f32 = 0.866;
/// Normals that are the same but for a step of one in this many are one.
const STEPS: f32 = 8192.0;
/// Faces around one vertex that are compared with each other; a fan of more is flat, so that a file of one point and a million
/// faces takes no square of that.
const MOST_AROUND: usize = 256;

/// Normals where the surface has none: of a face whose entry of `flat` is true its own; of another the area-weighted mean of
/// the faces around a vertex that lie within 30 degrees of it. Vertices are doubled at creases; `uvs` follow.
pub(crate) fn add_creased_normals(surface: &mut Surface, uvs: &mut [Vec<[f32; 2]>], flat: &[bool]) {
    let faces: Vec<Vec3> = surface.triangles.iter().map(|t| doubled_area(surface, *t)).collect();
    let units: Vec<Vec3> = faces.iter().map(|n| n.normalize_or(Vec3::Z)).collect();
    // Vertices of one place are one point of the surface, also where a seam of texture coordinates doubles them.
    let mut places: HashMap<[u32; 3], u32> = HashMap::new();
    let place: Vec<u32> = surface
        .vertices
        .iter()
        .map(|v| {
            let next = places.len() as u32;
            *places.entry(v.map(|x| (x + 0.0).to_bits())).or_insert(next)
        })
        .collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); places.len()];
    for (t, corners) in surface.triangles.iter().enumerate() {
        corners.iter().for_each(|v| around[place[*v as usize] as usize].push(t as u32));
    }
    let normal = |t: usize, v: u32| {
        let others = &around[place[v as usize] as usize];
        if flat[t] || others.len() > MOST_AROUND {
            return units[t];
        }
        let near =
            |o: &&u32| !flat[**o as usize] && units[**o as usize].dot(units[t]) >= SMOOTH_COSINE;
        let sum: Vec3 = others.iter().filter(near).map(|o| faces[*o as usize]).sum();
        sum.normalize_or(units[t])
    };
    let wanted: Vec<[Vec3; 3]> = surface
        .triangles
        .iter()
        .enumerate()
        .map(|(t, corners)| corners.map(|v| normal(t, v)))
        .collect();
    split(surface, uvs, &wanted);
}

/// [`add_creased_normals`] of faces that are all flat.
pub(crate) fn add_flat_normals(surface: &mut Surface, uvs: &mut [Vec<[f32; 2]>]) {
    let flat = |t: &[u32; 3]| [doubled_area(surface, *t).normalize_or(Vec3::Z); 3];
    let wanted: Vec<[Vec3; 3]> = surface.triangles.iter().map(flat).collect();
    split(surface, uvs, &wanted);
}

fn doubled_area(surface: &Surface, triangle: [u32; 3]) -> Vec3 {
    let [a, b, c] = triangle.map(|v| Vec3::from(surface.vertices[v as usize]));
    let n = (b - a).cross(c - a);
    if n.is_finite() { n } else { Vec3::ZERO }
}

/// Gives every corner its normal: a vertex per vertex and normal.
fn split(surface: &mut Surface, uvs: &mut [Vec<[f32; 2]>], wanted: &[[Vec3; 3]]) {
    let mut numbers: HashMap<(u32, [i32; 3]), u32> = HashMap::new();
    let mut of: Vec<u32> = Vec::new();
    let mut normals = Vec::new();
    for (corners, wanted) in surface.triangles.iter_mut().zip(wanted) {
        for (v, normal) in corners.iter_mut().zip(wanted) {
            // Triangles of one polygon differ in the last bits.
            let key = (*v, normal.to_array().map(|x| (x * STEPS).round() as i32));
            *v = *numbers.entry(key).or_insert_with(|| {
                of.push(*v);
                normals.push(normal.to_array());
                of.len() as u32 - 1
            });
        }
    }
    fn pick<T: Copy>(values: &mut Vec<T>, of: &[u32]) {
        if !values.is_empty() {
            *values = of.iter().map(|v| values[*v as usize]).collect();
        }
    }
    pick(&mut surface.vertices, &of);
    pick(&mut surface.base_color_linear, &of);
    pick(&mut surface.roughness, &of);
    pick(&mut surface.metallic, &of);
    uvs.iter_mut().for_each(|set| pick(set, &of));
    surface.normals = normals;
}
