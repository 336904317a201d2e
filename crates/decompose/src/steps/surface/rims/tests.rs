//! A table over a ground, thin and thick.

use glam::Vec3;

use super::super::extract::tests::pictures;
use super::super::planes::Plane;
use super::*;

const VOXEL: f32 = 0.02;
const TOLERANCE: f32 = 2.5 * VOXEL;
const RADIUS: f32 = 0.4;
const GROUND: f32 = -0.6;

/// Depth of a table of a thickness, its top at z = 0, over the ground.
fn depth(view: &View, ray: Vec3, thickness: f32) -> f32 {
    let at = |z: f32| view.center + ray * z;
    let top = -view.center.z / ray.z;
    if at(top).truncate().length() < RADIUS {
        return top;
    }
    // The side that faces the camera.
    let (o, d) = (view.center.truncate(), ray.truncate());
    let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - RADIUS * RADIUS);
    let side = (-b - (b * b - a * c).max(0.0).sqrt()) / a;
    let is_side = b * b > a * c && at(side).z < 0.0 && at(side).z > -thickness;
    if is_side { side } else { (GROUND - view.center.z) / ray.z }
}

/// A ring below the rim of the table, faces outside.
fn ring() -> Mesh {
    let mut mesh = Mesh::default();
    let count = 48;
    for k in 0..count {
        let angle = std::f32::consts::TAU * k as f32 / count as f32;
        let rim = Vec3::new(angle.cos(), angle.sin(), 0.0) * (RADIUS + 0.5 * VOXEL);
        mesh.vertices.extend([rim - Vec3::Z * VOXEL, rim - Vec3::Z * 4.0 * VOXEL]);
        let [a, b] = [2 * k, 2 * ((k + 1) % count)];
        mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    mesh
}

/// Triangles of the ring that are left.
fn left(thickness: f32) -> usize {
    let table = |view: &View, ray: Vec3| depth(view, ray, thickness);
    let (views, maps) = pictures(0.0, &table, &table);
    let plane = Plane { normal: Vec3::Z, offset: 0.0 };
    let sheet = Sheet::new(plane, &views, &maps, TOLERANCE, VOXEL, 4.0 * VOXEL).unwrap();
    let mut mesh = ring();
    drop_aprons(&mut mesh, &views, &maps, &[sheet], VOXEL);
    mesh.triangles.len()
}

#[test]
fn an_apron_goes_and_the_side_of_a_table_stays() {
    assert_eq!(left(0.0), 0, "photos see the ground below a thin table");
    assert_eq!(left(0.1), ring().triangles.len(), "photos see the side of a thick one");
}
