//! A ball before a chequered plane, matte and as a mirror.

use glam::DVec3;
use motes_scene::UnitWorld;
use motes_shading::tracing::{Plane, Shapes, Sphere};

use super::super::extract::tests::{RADIUS, photos};
use super::*;

const CENTER: Vec3 = Vec3::new(0.0, 0.0, 0.25);

/// A ball of `radius` without what is under the plane, and its normals.
fn ball(radius: f32) -> (Mesh, Vec<Vec3>) {
    let (rows, columns) = (40u32, 80u32);
    let mut mesh = Mesh::default();
    let mut normals = Vec::new();
    for y in 0..=rows {
        for x in 0..columns {
            let (theta, phi) = (
                y as f32 / rows as f32 * std::f32::consts::PI,
                x as f32 / columns as f32 * std::f32::consts::TAU,
            );
            let n = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            normals.push(n);
            mesh.vertices.push(CENTER + n * radius);
        }
    }
    for y in 0..rows {
        for x in 0..columns {
            let at = |x: u32, y: u32| y * columns + x % columns;
            let (a, b, c, d) = (at(x, y), at(x, y + 1), at(x + 1, y + 1), at(x + 1, y));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (mesh, normals)
}

fn ground() -> Mesh {
    let corner = |x: f32, y: f32| Vec3::new(4.0 * x, 4.0 * y, 0.0);
    Mesh {
        vertices: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Twelve photos of a ball before a chequered plane, 16 rays per pixel. A mirror shows something else in every photo.
fn pictures(is_mirror: bool) -> Vec<View> {
    let shapes = Shapes {
        spheres: vec![Sphere { center: CENTER.as_dvec3(), radius: RADIUS }],
        planes: vec![Plane { point: DVec3::ZERO, normal: DVec3::Z }],
    };
    let mut photos = photos(12, 1.0, DVec3::ZERO);
    for (k, photo) in photos.iter_mut().enumerate() {
        let view = View::new(photo, &UnitWorld::IDENTITY);
        let color = |x: f32, y: f32| {
            let ray = Ray::new(view.center, view.ray(x, y).normalize());
            let Some(hit) = shapes.closest_hit(&ray) else { return Vec3::splat(0.8) };
            let p = ray.at(hit.distance);
            if (p - CENTER).length() < RADIUS as f32 * 1.001 {
                let n = (p - CENTER).normalize();
                let other = ((7 * k) % 12) as f32 / 12.0;
                let light = if is_mirror { 0.2 + other } else { 0.6 + 0.4 * n.z };
                return Vec3::new(0.7, 0.35, 0.15) * light;
            }
            let dark = ((p.x * 9.0).floor() + (p.y * 9.0).floor()).rem_euclid(2.0);
            Vec3::splat(0.25 + 0.3 * dark)
        };
        for y in 0..view.height {
            for x in 0..view.width {
                let sum: Vec3 = (0..16)
                    .map(|s| {
                        let (u, v) = ((s % 4) as f32 + 0.5, (s / 4) as f32 + 0.5);
                        color(x as f32 + u / 4.0, y as f32 + v / 4.0)
                    })
                    .sum();
                photo.radiance_linear.floats_mut()[y * photo.camera.width + x] =
                    (sum / 16.0).to_array();
            }
        }
    }
    photos.iter().map(|p| View::new(p, &UnitWorld::IDENTITY)).collect()
}

#[test]
fn outlines_tell_how_much_too_small_or_large_a_thing_is() {
    let pixel = 0.0108;
    for is_mirror in [false, true] {
        let views = pictures(is_mirror);
        for size in [0.96f32, 1.0, 1.03] {
            let (mesh, normals) = ball(RADIUS as f32 * size);
            let rays = Rays::new(&mesh, &ground()).unwrap();
            let found = outlines(&mesh, &normals, &rays, &views, pixel);
            // Near the plane the photos see the ball before its own foot.
            let told: Vec<&Outline> = found
                .iter()
                .zip(&mesh.vertices)
                .filter(|(o, p)| o.confidence > 0.0 && p.z > 0.1)
                .map(|(o, _)| o)
                .collect();
            let weight: f32 = told.iter().map(|o| o.confidence).sum();
            let mean =
                told.iter().map(|o| o.confidence * o.displacement).sum::<f32>() / weight / pixel;
            let wanted = RADIUS as f32 * (1.0 - size) / pixel;
            println!(
                "mirror {is_mirror}, size {size}: {mean} for {wanted} pixels, {} vertices",
                told.len()
            );
            assert!(told.len() > 200, "{}", told.len());
            assert!((mean - wanted).abs() < 0.2, "{is_mirror} {size}: {mean} for {wanted} pixels");
        }
    }
}

#[test]
fn photos_of_one_color_tell_nothing() {
    let photos = photos(12, 1.0, DVec3::ZERO);
    let views: Vec<View> = photos.iter().map(|p| View::new(p, &UnitWorld::IDENTITY)).collect();
    let (mesh, normals) = ball(RADIUS as f32);
    let rays = Rays::new(&mesh, &ground()).unwrap();
    let found = outlines(&mesh, &normals, &rays, &views, 0.01);
    assert!(found.iter().all(|o| o.confidence == 0.0));
    assert!(Rays::new(&Mesh::default(), &Mesh::default()).is_none());
}
