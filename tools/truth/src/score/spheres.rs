//! The three-sphere protocol of the lighting-estimation literature (LeGendre et al. 2019; Gardner et al. 2019; Wang et al. 2022): a diffuse,
//! a glossy and a mirror sphere under an estimated and under the true light.
//!
//! The spheres are seen orthographically from three sides, 15 degrees above the horizon, in linear values without clipping. Per
//! sphere: the root mean square error, the same after the best factor (scale-invariant), and the mean angle between RGB vectors.
//! The light is averaged to 32 rows for the diffuse and the glossy sphere, so that their integrals are sums; a mirror sees the map itself.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use motes_math::resample::{Filter, resize};
use motes_scene::ImageF32;
use motes_shading::brdf::{Brdf, Lobes, Material};
use motes_shading::environment::{Orientation, direction_from_uv, uv_from_direction};
use rayon::prelude::*;
use serde::Serialize;

/// Pixels across a sphere.
pub const SIDE: usize = 64;
const ROWS: usize = 32;
const AZIMUTHS_DEG: [f64; 3] = [0.0, 120.0, 240.0];
const ELEVATION_DEG: f64 = 15.0;
/// What the spheres are made of.
const GRAY: f32 = 0.8;
const GLOSSY_ROUGHNESS: f32 = 0.35;

/// A light to be compared: linear RGB with axes.
#[derive(Clone, Debug)]
pub struct MapWithAxes {
    /// Row 0 up.
    pub image: ImageF32,
    /// Where its axes are.
    pub orientation: Orientation,
}

/// Errors of one sphere.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct SphereScores {
    /// Root mean square error over that of the true sphere: 1 for a black one.
    pub rmse: f64,
    /// After the best factor.
    pub si_rmse: f64,
    /// That factor.
    pub factor: f64,
    /// Mean angle between RGB vectors, degrees.
    pub angle_deg: f64,
}

/// Scores and pictures of the three spheres.
#[derive(Clone, Debug, Default)]
pub struct Spheres {
    /// By name: `diffuse`, `glossy`, `mirror`.
    pub scores: BTreeMap<&'static str, SphereScores>,
    /// Truth and estimate of every sphere seen from the first side, in the order of the names, linear.
    pub pictures: Vec<(&'static str, ImageF32, ImageF32)>,
}

/// Compares two lights.
pub fn compare(truth: &MapWithAxes, estimate: &MapWithAxes) -> Spheres {
    let mut out = Spheres::default();
    for name in ["diffuse", "glossy", "mirror"] {
        let (mut pixels, mut first) = (Vec::new(), None);
        for azimuth in AZIMUTHS_DEG {
            let [a, b] = [truth, estimate].map(|map| sphere(map, name, azimuth));
            pixels.extend(inside().flat_map(|i| {
                let at =
                    |image: &ImageF32| Vec3::from_slice(&image.data[3 * i..3 * i + 3]).as_dvec3();
                [(at(&a), at(&b))]
            }));
            first.get_or_insert((a, b));
        }
        out.scores.insert(name, scores(&pixels));
        out.pictures.extend(first.map(|(a, b)| (name, a, b)));
    }
    out
}

fn scores(pixels: &[(DVec3, DVec3)]) -> SphereScores {
    let sum = |of: &dyn Fn(&(DVec3, DVec3)) -> f64| pixels.iter().map(of).sum::<f64>();
    let power = sum(&|(t, _)| t.length_squared()).max(1e-30);
    let factor = sum(&|(t, e)| t.dot(*e)) / sum(&|(_, e)| e.length_squared()).max(1e-30);
    let angle = |(t, e): &(DVec3, DVec3)| {
        let lengths = t.length() * e.length();
        if lengths > 0.0 { (t.dot(*e) / lengths).clamp(-1.0, 1.0).acos().to_degrees() } else { 0.0 }
    };
    SphereScores {
        rmse: (sum(&|(t, e)| t.distance_squared(*e)) / power).sqrt(),
        si_rmse: (sum(&|(t, e)| t.distance_squared(*e * factor)) / power).sqrt(),
        factor,
        angle_deg: sum(&angle) / pixels.len().max(1) as f64,
    }
}

fn place(i: usize) -> (f64, f64) {
    let at = |k: usize| 2.0 * (k as f64 + 0.5) / SIDE as f64 - 1.0;
    (at(i % SIDE), -at(i / SIDE))
}

fn inside() -> impl Iterator<Item = usize> {
    (0..SIDE * SIDE).filter(|i| {
        let (x, y) = place(*i);
        // The rim is seen at grazing angles that a pixel does not resolve.
        x * x + y * y < 0.95
    })
}

fn sphere(map: &MapWithAxes, name: &str, azimuth_deg: f64) -> ImageF32 {
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    let (up, flat) = ELEVATION_DEG.to_radians().sin_cos();
    let to_viewer = DVec3::new(cos * flat, sin * flat, up);
    let right = DVec3::Z.cross(to_viewer).normalize();
    let top = to_viewer.cross(right);
    let lights = lights(map);
    let shade = |i: usize| -> [f32; 3] {
        let (x, y) = place(i);
        let r2 = x * x + y * y;
        if r2 >= 1.0 {
            return [0.0; 3];
        }
        let n = right * x + top * y + to_viewer * (1.0 - r2).sqrt();
        match name {
            "mirror" => (look_up(map, 2.0 * n.dot(to_viewer) * n - to_viewer) * GRAY).to_array(),
            _ => reflected(&lights, name, n.as_vec3(), to_viewer.as_vec3()).to_array(),
        }
    };
    let data: Vec<[f32; 3]> = (0..SIDE * SIDE).into_par_iter().map(shade).collect();
    ImageF32::from_data(SIDE, SIDE, 3, data.into_iter().flatten().collect())
}

/// Directions (world), radiance times solid angle.
fn lights(map: &MapWithAxes) -> Vec<(Vec3, Vec3)> {
    let (w, h) = (map.image.width, map.image.height);
    let data = resize(&map.image.data, (w, h, 3), (2 * ROWS, ROWS), Filter::Box);
    let light = |i: usize| {
        let (x, y) = (i % (2 * ROWS), i / (2 * ROWS));
        let (u, v) = ((x as f64 + 0.5) / (2 * ROWS) as f64, (y as f64 + 0.5) / ROWS as f64);
        let edge = |y: usize| (PI * y as f64 / ROWS as f64).cos();
        let omega = TAU * (edge(y) - edge(y + 1)) / (2 * ROWS) as f64;
        let d = map.orientation.world_from_map(direction_from_uv(u, v)).as_vec3();
        (d, Vec3::from_slice(&data[3 * i..3 * i + 3]) * omega as f32)
    };
    (0..2 * ROWS * ROWS).map(light).collect()
}

fn reflected(lights: &[(Vec3, Vec3)], name: &str, n: Vec3, to_viewer: Vec3) -> Vec3 {
    let material = match name {
        "diffuse" => Material::lambert(Vec3::splat(GRAY)),
        _ => Material {
            lobes: Lobes::Principled,
            ..Material::principled(Vec3::splat(GRAY), GLOSSY_ROUGHNESS, 1.0)
        },
    };
    let brdf = Brdf::new(&material, n, to_viewer);
    let lit = lights.iter().filter(|(d, _)| d.dot(n) > 0.0);
    lit.map(|(d, flux)| brdf.eval_pdf(*d).0.total() * *flux).sum()
}

fn look_up(map: &MapWithAxes, world: DVec3) -> Vec3 {
    let (w, h) = (map.image.width, map.image.height);
    let (u, v) = uv_from_direction(map.orientation.map_from_world(world));
    let at = |t: f64, n: usize| ((t * n as f64).max(0.0) as usize).min(n - 1);
    Vec3::from_slice(map.image.pixel(at(u, w), at(v, h)))
}

#[cfg(test)]
mod tests {
    use motes_shading::environment::Convention;

    use super::*;

    fn map(lamp: usize, scale: f32) -> MapWithAxes {
        let mut image = ImageF32::filled(64, 32, 3, 0.2 * scale);
        for y in 6..10 {
            for x in lamp..lamp + 4 {
                image.pixel_mut(x, y).copy_from_slice(&[8.0 * scale, 7.0 * scale, 6.0 * scale]);
            }
        }
        MapWithAxes { image, orientation: Orientation::new(Convention::Blender) }
    }

    #[test]
    fn the_same_light_has_no_error_and_a_factor_is_taken_out() {
        let same = compare(&map(20, 1.0), &map(20, 1.0));
        assert!(same.scores.values().all(|s| s.rmse < 1e-6 && s.angle_deg < 0.1));
        let half = compare(&map(20, 1.0), &map(20, 0.5));
        for s in half.scores.values() {
            assert!(
                (s.rmse - 0.5).abs() < 1e-3 && s.si_rmse < 1e-4 && (s.factor - 2.0).abs() < 1e-3
            );
        }
    }

    #[test]
    fn a_lamp_at_the_wrong_place_shows_on_every_sphere_most_on_the_mirror() {
        let moved = compare(&map(20, 1.0), &map(40, 1.0)).scores;
        assert!(
            moved["diffuse"].si_rmse > 0.2 && moved["mirror"].si_rmse > moved["diffuse"].si_rmse
        );
    }
}
