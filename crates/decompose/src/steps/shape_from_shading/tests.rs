//! A ball of two colors with bumps that its surface lacks, under a lamp and a sky: photos by sums over the light.

use super::*;
use glam::DVec3;
use motes_scene::{ImageF32, Pinhole, Pose};

use crate::appearance::VertexMaterials;
use crate::observation::{Photo, SeenView, TracedSurface, ViewRays};
use crate::toy_ball::{ball, direction_of_pixel, light_of};

const VIEWS: usize = 12;
const MAP: [usize; 2] = [64, 32];

fn sky(d: Vec3) -> Vec3 {
    let lamp = ((d.dot(Vec3::new(0.5, 0.3, 0.8).normalize()) - 1.0) / 0.02).exp();
    Vec3::new(0.2, 0.25, 0.35) + Vec3::new(9.0, 8.0, 7.0) * lamp
}

/// Directions of the map with radiance times solid angle over π.
fn lamps() -> Vec<(Vec3, Vec3)> {
    let [w, h] = MAP;
    let lamp = |k: usize| {
        let (d, v) = (direction_of_pixel(MAP, k), ((k / w) as f64 + 0.5) / h as f64);
        let area = 2.0 * std::f64::consts::PI / (w * h) as f64 * (std::f64::consts::PI * v).sin();
        (d, sky(d) * area as f32)
    };
    (0..w * h).map(lamp).collect()
}

fn bumps(d: Vec3) -> f32 {
    (7.0 * d.x).sin() * (7.0 * d.y + 1.0).sin() * (7.0 * d.z).cos()
}

/// A unit ball with bumps of this height.
fn bumpy(height: f32) -> Surface {
    ball(60, |d| 1.0 + height * bumps(d))
}

/// Two colors in patches, as far as `contrast` goes.
fn base_color(p: Vec3, contrast: f32) -> Vec3 {
    let patch = ((1.2 * p).round().as_ivec3().element_sum() % 2).abs() as f32;
    Vec3::new(0.6, 0.5, 0.4) * (1.0 - contrast * patch)
}

fn photo(index: usize, truth: &TracedSurface, exposure: f32, contrast: f32) -> Photo {
    let turn = index as f64 * 2.4;
    let eye = DVec3::new(turn.cos(), turn.sin(), 0.4 + 1.6 * (index % 4) as f64) * 2.0;
    let size = 160;
    let camera = Pinhole { fx: 200.0, fy: 200.0, cx: 80.0, cy: 80.0, width: size, height: size };
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
    let (rays, lamps) = (ViewRays::new(&out), lamps());
    for (k, hit) in rays.hits(truth).iter().enumerate().filter(|(_, hit)| hit.is_hit()) {
        let d = rays.direction((k % size) as f32 + 0.5, (k / size) as f32 + 0.5);
        let (position, normal, _) = truth.frame(hit, -d);
        let received: Vec3 = lamps
            .iter()
            .map(|(to, l)| *l * (normal.dot(*to).max(0.0) / std::f32::consts::PI))
            .sum();
        let shown = base_color(position, contrast) * received * exposure;
        out.radiance_linear.floats_mut()[k] = shown.to_array();
    }
    out
}

struct Case {
    /// Of the bumps: in truth, and of the surface that is given.
    height: [f32; 2],
    exposure: f32,
    contrast: f32,
    metallic: f32,
    /// Factor on the light that is believed.
    light: f32,
}

const CASE: Case =
    Case { height: [0.02, 0.0], exposure: 1.0, contrast: 0.5, metallic: 0.0, light: 1.0 };

/// The normals of the truth are `off` by so many degrees before and after where the lamp shines, and the surface.
fn run(case: &Case) -> ([f32; 2], Option<(Surface, Displaced)>) {
    let truth = TracedSurface::new(bumpy(case.height[0])).unwrap();
    let scene = TracedSurface::new(bumpy(case.height[1])).unwrap();
    let photos: Vec<Photo> =
        (0..VIEWS).map(|k| photo(k, &truth, case.exposure, case.contrast)).collect();
    let views: Vec<SeenView<'_>> = photos.iter().map(|p| SeenView::new(p, &scene)).collect();
    let n = scene.surface.vertices.len();
    let materials = VertexMaterials { metallic: vec![case.metallic; n], ..Default::default() };
    let shaded = Shaded {
        scene: &scene,
        views: &views,
        lights: &[light_of(MAP, |d| sky(d) * (case.exposure * case.light))],
        vertex_radiance: &[],
        materials: &materials,
        smoothness: 1.0,
        ray_bias: 5e-3,
        seed: 3,
    };
    let found = shaded.reshaped(3);
    let to_lamp = Vec3::new(0.5, 0.3, 0.8).normalize();
    let off = |surface: &Surface| {
        let angles = (0..n).filter_map(|v| {
            let right = Vec3::from(truth.surface.normals[v]);
            let near = Vec3::from(scene.surface.vertices[v]).normalize().dot(to_lamp);
            let angle = right.angle_between(Vec3::from(surface.normals[v]));
            (0.3..0.9).contains(&near).then_some(angle)
        });
        let (sum, count) = angles.fold((0.0, 0.0f32), |(s, c), a| (s + a, c + 1.0));
        (sum / count).to_degrees()
    };
    let after = found.as_ref().map_or(&scene.surface, |(surface, _)| surface);
    ([off(&scene.surface), off(after)], found)
}

#[test]
fn bumps_are_found_at_any_exposure_and_brightness() {
    let plain = Case { contrast: 0.0, ..CASE };
    let ([before, after], found) = run(&plain);
    println!("{before} -> {after} degrees, {:?}", found.unwrap().1);
    // One lamp tells one of the two slopes that a normal has: of the square of the error half stays.
    assert!(before > 3.5 && after < 0.75 * before, "{before} {after}");
    for (exposure, light) in [(1e-4, 1.0), (1e4, 1.0), (1.0, 10.0)] {
        let ([_, other], found) = run(&Case { exposure, light, ..plain });
        assert!((other - after).abs() < 0.02 * after, "{exposure} {light}: {other} {after}");
        assert!(found.unwrap().0.vertices.as_flattened().iter().all(|v| v.is_finite()));
    }
}

#[test]
fn bumps_are_found_under_texture() {
    let ([before, after], found) = run(&CASE);
    println!("{before} -> {after} degrees, {:?}", found.unwrap().1);
    assert!(after < 0.85 * before, "{before} {after}");
}

#[test]
fn texture_moves_nothing() {
    for contrast in [0.0, 0.5, 0.9] {
        let ([before, after], _) = run(&Case { height: [0.02; 2], contrast, ..CASE });
        println!("contrast {contrast}: {before} -> {after} degrees");
        assert!(before < 1e-3 && after < 1.0, "{contrast}: {after}");
    }
}

#[test]
fn metals_and_darkness_stay() {
    assert!(run(&Case { metallic: 1.0, ..CASE }).1.is_none());
    assert!(run(&Case { exposure: 0.0, ..CASE }).1.is_none());
    // A light that was found to be nothing explains nothing.
    let (_, found) = run(&Case { light: 0.0, ..CASE });
    let (surface, report) = found.unwrap();
    assert!(surface.normals.as_flattened().iter().all(|v| v.is_finite()));
    assert!(report.turn_degrees < 1e-3, "{report:?}");
}
