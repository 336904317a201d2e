//! Meshes of known shapes; for tests of this crate only.

use glam::Vec3;
use motes_shading::tracing::TriangleMesh;

/// A sphere of `4 n²` triangles round the poles, closed.
pub(crate) fn sphere(center: Vec3, radius: f32, n: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let columns = 2 * n;
    for i in 0..=n {
        for j in 0..columns {
            let theta = std::f64::consts::PI * f64::from(i) / f64::from(n);
            let phi = std::f64::consts::TAU * f64::from(j) / f64::from(columns);
            let d = Vec3::new(
                (theta.sin() * phi.cos()) as f32,
                (theta.sin() * phi.sin()) as f32,
                theta.cos() as f32,
            );
            // One position per pole, so that the mesh is closed.
            let d = if i == 0 {
                Vec3::Z
            } else if i == n {
                -Vec3::Z
            } else {
                d
            };
            mesh.vertices.push(center + d * radius);
        }
    }
    for i in 0..n {
        for j in 0..columns {
            let k = (j + 1) % columns;
            let (a, b) = (i * columns + j, i * columns + k);
            let (c, d) = (a + columns, b + columns);
            if i > 0 {
                mesh.triangles.push([a, c, b]);
            }
            if i + 1 < n {
                mesh.triangles.push([b, c, d]);
            }
        }
    }
    mesh
}

/// The square `|x|, |y| <= half` at height `z`, facing up, as two triangles.
pub(crate) fn floor(half: f32, z: f32) -> TriangleMesh {
    let at = |x: f32, y: f32| Vec3::new(x * half, y * half, z);
    TriangleMesh {
        vertices: vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Both meshes in one.
pub(crate) fn joined(mut a: TriangleMesh, b: &TriangleMesh) -> TriangleMesh {
    let first = a.vertices.len() as u32;
    a.vertices.extend(&b.vertices);
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|i| i + first)));
    a
}
