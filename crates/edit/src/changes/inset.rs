//! Meshes moved in by what their Gaussians show beyond them.
//!
//! Gaussians on a surface show beyond its outline: there many of them lie behind each other, and together they are opaque to more than
//! a standard deviation outside. Moved in by as much, their outline is nearly that of the mesh. A thin mesh is moved in by a part of its
//! thickness only.

use glam::Vec3;
use motes_scene::Materials;
use motes_shading::tracing::{BuildQuality, MeshTracer, Ray, Tracer, TriangleMesh};
use rayon::prelude::*;

use super::insert::Asset;

/// How far a mesh is moved in, over the standard deviation that the rasterizer shows of its Gaussians.
const INSET: f32 = 1.1;
/// The same over its thickness, at most.
const OF_THICKNESS: f32 = 0.2;

/// Moves a mesh and its Gaussians in. What is no mesh stays as it is.
pub(crate) fn inset(asset: &mut Asset) {
    let Some(surface) = asset.surface.as_mut().filter(|_| asset.mesh.is_some()) else { return };
    let Ok(normals) = Materials::of(&asset.gaussians).map(|m| m.normals) else { return };
    let Some(width) = asset.gaussians.log_scales.first().map(|s| s[0].max(s[1]).exp()) else {
        return;
    };
    let Ok(tracer) = MeshTracer::new(&TriangleMesh::from(&*surface), BuildQuality::Fast) else {
        return;
    };
    // As the rasterizer shows them.
    let shown =
        (width.powi(2) + motes_raster::BLUR_VARIANCE_PX2 * (asset.pixel as f32).powi(2)).sqrt();
    let most = INSET * shown;
    let move_in = |points: &mut [[f32; 3]], normals: &[[f32; 3]]| {
        points.par_iter_mut().zip(normals).for_each(|(point, normal)| {
            let (p, n) = (Vec3::from(*point), Vec3::from(*normal).normalize_or_zero());
            // From below the point, whose own triangles are not the other side.
            let ray = Ray { t_min: 0.1 * width, ..Ray::new(p, -n) };
            let thickness = tracer.closest_hit(&ray).map_or(f32::INFINITY, |hit| hit.distance);
            *point = (p - n * most.min(OF_THICKNESS * thickness)).to_array();
        });
    };
    move_in(&mut asset.gaussians.means, &normals);
    move_in(&mut surface.vertices, &surface.normals);
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Quat};
    use motes_codecs::mesh::Mesh;
    use motes_raster::{RenderOptions, render};
    use motes_scene::{Pinhole, Pose, Surface};

    use super::*;
    use crate::changes::mesh::{area, count_for_pixels, gaussians_on};

    fn surface(vertices: Vec<Vec3>, normals: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Surface {
        let n = vertices.len();
        Surface {
            vertices: vertices.iter().map(|v| v.to_array()).collect(),
            normals: normals.iter().map(|v| v.to_array()).collect(),
            triangles,
            base_color_linear: vec![[1.0; 3]; n],
            roughness: vec![0.5; n],
            metallic: vec![0.0; n],
            ..Surface::default()
        }
    }

    fn ball() -> Surface {
        let (rows, columns) = (40u32, 80u32);
        let at = |i: u32, j: u32| {
            let turn = Quat::from_rotation_z(j as f32 / columns as f32 * std::f32::consts::TAU);
            turn * Quat::from_rotation_y(i as f32 / rows as f32 * std::f32::consts::PI) * Vec3::Z
        };
        let points: Vec<Vec3> =
            (0..=rows).flat_map(|i| (0..columns).map(move |j| at(i, j))).collect();
        let index = |i, j| i * columns + j % columns;
        let cell = |i, j| {
            [
                [index(i, j), index(i + 1, j), index(i + 1, j + 1)],
                [index(i, j), index(i + 1, j + 1), index(i, j + 1)],
            ]
        };
        let triangles =
            (0..rows).flat_map(|i| (0..columns).flat_map(move |j| cell(i, j))).collect();
        surface(points.clone(), points, triangles)
    }

    fn asset(surface: Surface, count: u64) -> Asset {
        let mesh = Mesh::plain(surface.clone(), DVec3::Z);
        let gaussians = gaussians_on(&mesh, Some(count as usize));
        Asset {
            name: "ball".into(),
            gaussians,
            surface: Some(surface),
            mesh: Some(mesh),
            pixel: 0.05,
            up: DVec3::Z,
        }
    }

    /// Square pixels that it covers in a picture where a unit is 20 pixels.
    fn covered(asset: &Asset) -> f32 {
        let camera = Pinhole { fx: 200.0, fy: 200.0, cx: 40.0, cy: 40.0, width: 80, height: 80 };
        let from = Pose::look_at(DVec3::Y * -10.0, DVec3::ZERO, DVec3::Z).unwrap();
        let shown = render(&asset.gaussians, &camera, &from, &RenderOptions::default());
        shown.alpha.data.iter().sum()
    }

    #[test]
    fn the_outline_becomes_that_of_the_mesh() {
        let ball = ball();
        let count = count_for_pixels(area(&ball) * 400.0);
        let mut asset = asset(ball, count);
        let truth = 400.0 * std::f32::consts::PI;
        let before = covered(&asset) / truth - 1.0;
        inset(&mut asset);
        let after = covered(&asset) / truth - 1.0;
        assert!(before > 0.08 && after.abs() < 0.5 * before, "{before} {after}");
    }

    #[test]
    fn a_thin_sheet_keeps_its_sides_and_what_is_no_mesh_its_place() {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let side = |z: f32| corners.map(|[x, y]| Vec3::new(x, y, z));
        let vertices = [side(0.01), side(-0.01)].concat();
        let normals = [[Vec3::Z; 4], [-Vec3::Z; 4]].concat();
        let sheet = surface(vertices, normals, vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]);
        let mut thin = asset(sheet, 100);
        let mut splat = Asset { mesh: None, ..thin.clone() };
        let before = splat.gaussians.means.clone();
        inset(&mut thin);
        inset(&mut splat);
        assert_eq!(splat.gaussians.means, before);
        for (new, old) in thin.gaussians.means.iter().zip(&before) {
            assert!(new[2] * old[2] > 0.0 && new[2].abs() < 0.0099, "{new:?} {old:?}");
        }
    }
}
