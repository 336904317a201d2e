//! A copper ball with a pit that is not there, under a sky of soft lamps: photos by the closed form of a mirror.

use super::*;
use glam::DVec3;
use motes_scene::{ImageF32, Pinhole, Pose};

use crate::observation::{Photo, ViewRays};
use crate::toy_ball::{ball, light_of};

const COPPER: Vec3 = Vec3::new(0.7, 0.35, 0.2);
const VIEWS: usize = 12;

/// Radiance of the sky: smooth, so that a mirror and a slightly rough metal show the same.
fn sky(d: Vec3) -> Vec3 {
    let lamp = |to: Vec3, width: f32| ((d.dot(to.normalize()) - 1.0) / width).exp();
    Vec3::new(0.15, 0.2, 0.3)
        + Vec3::new(2.0, 1.8, 1.5) * lamp(Vec3::new(0.4, 0.2, 0.9), 0.15)
        + Vec3::new(0.9, 0.3, 0.2) * lamp(Vec3::new(-0.8, 0.5, 0.4), 0.2)
        + Vec3::new(0.2, 0.4, 1.1) * lamp(Vec3::new(0.1, -0.9, 0.5), 0.2)
        + Vec3::new(0.1, 0.5, 0.1) * lamp(Vec3::new(0.2, 0.6, -0.6), 0.3)
}

/// A unit ball; with a dent of `depth` about +z and slightly aside.
fn dented(depth: f32) -> Surface {
    ball(40, |d| {
        let away = d.angle_between(Vec3::new(0.25, 0.1, 1.0)) / 0.3;
        1.0 - depth * (-away * away).exp()
    })
}

fn photo(index: usize, exposure: f32) -> Photo {
    let turn = index as f64 * 2.4;
    let eye = DVec3::new(turn.cos(), turn.sin(), 0.4 + 1.6 * (index % 4) as f64) * 2.0;
    let size = 96;
    let camera = Pinhole { fx: 120.0, fy: 120.0, cx: 48.0, cy: 48.0, width: size, height: size };
    let mut out = Photo {
        gain: [1.0; 3],
        light: 0,
        name: format!("{index}"),
        camera,
        camera_from_world: Pose::look_at(eye, DVec3::ZERO, DVec3::Z).unwrap(),
        radiance_linear: ImageF32::filled(size, size, 3, 0.0).into(),
        usable: vec![true; size * size],
        clipped: Vec::new(),
    };
    let rays = ViewRays::new(&out);
    for k in 0..size * size {
        let d = rays.direction((k % size) as f32 + 0.5, (k / size) as f32 + 0.5);
        // The true ball, not the dented one.
        let along = -rays.eye.dot(d);
        let discriminant = along * along - rays.eye.length_squared() + 1.0;
        if discriminant > 0.0 {
            let n = (rays.eye + d * (along - discriminant.sqrt())).normalize();
            let cos = -d.dot(n);
            let reflectance = COPPER + (Vec3::ONE - COPPER) * (1.0 - cos).powi(5);
            let radiance = sky(d + 2.0 * cos * n) * reflectance * exposure;
            out.radiance_linear.floats_mut()[k] = radiance.to_array();
        }
    }
    out
}

fn reshaped(depth: f32, exposure: f32, metallic: f32) -> (TracedSurface, Option<Reshaped>) {
    let scene = TracedSurface::new(dented(depth)).unwrap();
    let photos: Vec<Photo> = (0..VIEWS).map(|k| photo(k, exposure)).collect();
    let views: Vec<SeenView<'_>> = photos.iter().map(|p| SeenView::new(p, &scene)).collect();
    let n = scene.surface.vertices.len();
    let materials = VertexMaterials {
        metallic: vec![metallic; n],
        roughness: vec![0.5; n],
        part: vec![0; n],
        ..VertexMaterials::default()
    };
    let bounce = vec![vec![Vec3::splat(0.3 * exposure); n]];
    let mirrors = Mirrors {
        scene: &scene,
        views: &views,
        lights: &[light_of([128, 64], |d| sky(d) * exposure)],
        vertex_radiance: &bounce,
        materials: &materials,
        smoothness: 8.0,
        ray_bias: 5e-3,
    };
    let found = mirrors.reshaped(3);
    (scene, found)
}

/// Mean angle between normals and directions from the center about the dent, degrees.
fn off(surface: &Surface) -> f32 {
    let near = (0..surface.vertices.len())
        .map(|v| (Vec3::from(surface.vertices[v]).normalize(), Vec3::from(surface.normals[v])))
        .filter(|(d, _)| d.angle_between(Vec3::new(0.25, 0.1, 1.0)) < 0.6);
    let (sum, n) = near.fold((0.0, 0.0f32), |(s, n), (d, own)| (s + d.angle_between(own), n + 1.0));
    (sum / n).to_degrees()
}

#[test]
fn a_pit_in_a_mirror_is_closed_at_any_exposure() {
    let (scene, found) = reshaped(0.2, 1.0, 1.0);
    let found = found.unwrap();
    let (before, after) = (off(&scene.surface), off(&found.surface));
    println!("{before} -> {after} degrees, {:?}, {:?}", found.round, found.roughness[0]);
    assert!(before > 12.0 && after < 0.5 * before, "{before} {after}");
    assert!(found.roughness.iter().flatten().all(|r| *r <= 0.36), "{:?}", found.roughness[0]);
    assert!(found.round.cost[1] < 0.5 * found.round.cost[0]);
    for exposure in [1e-4, 1e4] {
        let other = reshaped(0.2, exposure, 1.0).1.unwrap();
        let dark = off(&other.surface);
        assert!((dark - after).abs() < 0.2 * after + 0.3, "{exposure}: {dark} {after}");
        assert!(other.surface.vertices.as_flattened().iter().all(|v| v.is_finite()));
    }
}

#[test]
fn a_ball_that_is_right_stays() {
    let (scene, found) = reshaped(0.0, 1.0, 1.0);
    let found = found.unwrap();
    // Around the equator few photos see it; at the bottom none does.
    let moved = scene.surface.vertices.iter().zip(&found.surface.vertices);
    let seen = moved.filter(|(a, _)| a[2] > 0.2);
    let most = seen.map(|(a, b)| (Vec3::from(*a) - Vec3::from(*b)).length()).fold(0.0, f32::max);
    println!("off {} degrees, moved {most}", off(&found.surface));
    assert!(off(&found.surface) < 3.0 && most < 0.04, "{} {most}", off(&found.surface));
}

#[test]
fn without_metal_or_light_there_is_nothing_to_do() {
    assert!(reshaped(0.2, 1.0, 0.0).1.is_none());
    // All black: finite, and nothing is learned.
    let (scene, found) = reshaped(0.1, 0.0, 1.0);
    let found = found.unwrap();
    assert!(found.surface.normals.as_flattened().iter().all(|v| v.is_finite()));
    assert_eq!(found.surface.vertices.len(), scene.surface.vertices.len());
}
