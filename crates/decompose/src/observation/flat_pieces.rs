//! Flat pieces of the surface: tables, floors and walls, which have meshes of their own.

use glam::Vec3;
use motes_scene::Surface;

use super::photo::Photo;

/// Per triangle: 0 for things, else a number that names its flat piece.
pub(crate) fn sheet_of_triangles(surface: &Surface) -> Vec<u32> {
    let vertices = surface.vertices.len() as u32;
    let mut parent: Vec<u32> = (0..vertices).collect();
    for t in &surface.triangles {
        for k in 1..3 {
            let (a, b) = (root(&mut parent, t[0]), root(&mut parent, t[k]));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let roots: Vec<u32> = (0..vertices).map(|v| root(&mut parent, v)).collect();
    let mut flat = vec![true; surface.vertices.len()];
    for (v, &r) in roots.iter().enumerate() {
        let (n, m) = (Vec3::from(surface.normals[v]), Vec3::from(surface.normals[r as usize]));
        flat[r as usize] &= n.dot(m) > 0.9999;
    }
    let of = |t: &[u32; 3]| roots[t[0] as usize];
    surface.triangles.iter().map(|t| if flat[of(t) as usize] { of(t) + 1 } else { 0 }).collect()
}

fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

/// Unit vector away from the ground: the normal of the largest flat piece that faces up as the cameras have it, else
/// the mean of the cameras' upward axes; +z without photos.
pub fn up_in_world(surface: &Surface, photos: &[Photo]) -> Vec3 {
    let up_of = |p: &Photo| -p.camera_from_world.inverse().rotation_matrix().y_axis.as_vec3();
    let mean = photos.iter().map(up_of).sum::<Vec3>().normalize_or(Vec3::Z);
    let mut areas: std::collections::BTreeMap<u32, (f32, Vec3)> = std::collections::BTreeMap::new();
    for (t, sheet) in surface.triangles.iter().zip(sheet_of_triangles(surface)) {
        let [a, b, c] = t.map(|v| Vec3::from(surface.vertices[v as usize]));
        let normal = Vec3::from(surface.normals[t[0] as usize]);
        if sheet != 0 && normal.dot(mean) > 0.5 {
            areas.entry(sheet).or_insert((0.0, normal)).0 += (b - a).cross(c - a).length();
        }
    }
    areas.values().max_by(|a, b| a.0.total_cmp(&b.0)).map_or(mean, |(_, normal)| *normal)
}
