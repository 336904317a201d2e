//! A ball for tests, and light from a function of the direction.

use glam::Vec3;
use motes_scene::{ImageF32, Surface};
use motes_shading::environment::{Environment, EnvironmentMap, MapOptions, direction_from_uv};

use crate::mesh::Mesh;

/// Rows of twice as many vertices, whose distance from the center is that of their direction.
pub(crate) fn ball(rows: u32, radius: impl Fn(Vec3) -> f32) -> Surface {
    let columns = 2 * rows;
    let mut s = Surface::default();
    for k in 0..(rows + 1) * columns {
        let theta = (k / columns) as f32 / rows as f32 * std::f32::consts::PI;
        let phi = (k % columns) as f32 / columns as f32 * std::f32::consts::TAU;
        let d = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        s.vertices.push((d * radius(d)).to_array());
    }
    let at = |x: u32, y: u32| y * columns + x % columns;
    for (x, y) in (0..rows * columns).map(|k| (k % columns, k / columns)) {
        let [a, b, c, d] = [at(x, y), at(x, y + 1), at(x + 1, y + 1), at(x + 1, y)];
        s.triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|t| {
            let [p, q, r] = t.map(|v| Vec3::from(s.vertices[v as usize]));
            (q - p).cross(r - p).length() > 1e-9
        }));
    }
    s.normals = Mesh::of(&s).vertex_normals().iter().map(Vec3::to_array).collect();
    s
}

/// Direction of pixel `k` of a map of the usual axes.
pub(crate) fn direction_of_pixel([w, h]: [usize; 2], k: usize) -> Vec3 {
    let (u, v) = (((k % w) as f64 + 0.5) / w as f64, ((k / w) as f64 + 0.5) / h as f64);
    MapOptions::default().orientation.world_from_map(direction_from_uv(u, v)).as_vec3()
}

/// Light by its radiance per direction.
pub(crate) fn light_of([w, h]: [usize; 2], radiance: impl Fn(Vec3) -> Vec3) -> Environment {
    let mut map = ImageF32::filled(w, h, 3, 0.0);
    for k in 0..w * h {
        let shown = radiance(direction_of_pixel([w, h], k));
        map.pixel_mut(k % w, k / w).copy_from_slice(&shown.to_array());
    }
    Environment::new(EnvironmentMap::new(&map, &MapOptions::default()).ok(), None)
}
