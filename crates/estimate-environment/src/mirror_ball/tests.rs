use glam::{DVec3, Vec3};
use motes_scene::ImageF32;

use super::*;
use crate::sphere::{look_up, texel_direction, texel_solid_angle};

const REFLECTANCE: Vec3 = Vec3::new(0.7, 0.65, 0.6);

/// A light with a lamp and a colored gradient.
fn light(rows: usize) -> ImageF32 {
    let mut map = ImageF32::filled(2 * rows, rows, 3, 0.0);
    let lamp = DVec3::new(0.5, 0.6, -0.6).normalize();
    for y in 0..rows {
        for x in 0..2 * rows {
            let d = texel_direction(x, y, 2 * rows, rows);
            let near = ((d.dot(lamp) - 1.0) * 30.0).exp() as f32;
            let base =
                Vec3::new(0.4 + 0.3 * d.x as f32, 0.5 + 0.4 * d.y as f32, 0.6 - 0.3 * d.z as f32);
            map.pixel_mut(x, y).copy_from_slice(&(base + Vec3::splat(4.0 * near)).to_array());
        }
    }
    map
}

/// A ray-traced picture of the ball: independent of `unwrap`, forward from the camera.
fn picture(map: &ImageF32, outline: &Outline, distance: f64, size: (usize, usize)) -> ImageF32 {
    let mut image = ImageF32::filled(size.0, size.1, 3, 0.12);
    for y in 0..size.1 {
        for x in 0..size.0 {
            let at = DVec3::new(
                (x as f64 + 0.5 - outline.center[0]) / outline.radius,
                (y as f64 + 0.5 - outline.center[1]) / outline.radius,
                0.0,
            );
            let (origin, ray) = if distance.is_finite() {
                let tangent = 1.0 / (distance * distance - 1.0).sqrt();
                let d = DVec3::new(at.x * tangent, at.y * tangent, 1.0).normalize();
                (DVec3::new(0.0, 0.0, -distance), d)
            } else {
                (DVec3::new(at.x, at.y, -10.0), DVec3::Z)
            };
            let b = origin.dot(ray);
            let disc = b * b - (origin.length_squared() - 1.0);
            if disc < 0.0 {
                continue;
            }
            let n = origin + ray * (-b - disc.sqrt());
            let r = ray - 2.0 * ray.dot(n) * n;
            let value = look_up(map, DVec3::new(-r.x, -r.y, r.z)) * REFLECTANCE;
            image.pixel_mut(x, y).copy_from_slice(&value.to_array());
        }
    }
    image
}

#[test]
fn a_rendered_ball_unwraps_to_its_light() {
    let map = light(64);
    let outline = Outline { center: [170.3, 148.9], radius: 120.4 };
    for distance in [f64::INFINITY, 12.0, 3.0] {
        let photo = picture(&map, &outline, distance, (340, 300));
        let out = unwrap(&photo, &outline, distance, REFLECTANCE, 64, &|_| false);
        let (mut off, mut weight, mut seen) = (0.0, 0.0, 0.0);
        for y in 0..64 {
            let omega = texel_solid_angle(y, 128, 64);
            for x in 0..128 {
                let i = y * 128 + x;
                if out.seen[i] == 1.0 {
                    let [a, b] = [&out.radiance, &map].map(|m| Vec3::from_slice(m.pixel(x, y)));
                    off += omega * f64::from((a - b).length_squared() / 3.0);
                    weight += omega;
                }
                seen += omega * f64::from(out.seen[i]);
            }
        }
        let rms = (off / weight).sqrt();
        assert!(rms < 0.02, "{distance}: {rms}");
        // The wrong distance shows directions at the wrong place.
        let wrong = if distance == 3.0 { f64::INFINITY } else { 2.0 };
        let other = unwrap(&photo, &outline, wrong, REFLECTANCE, 64, &|_| false);
        let apart = |o: &Unwrapped| -> f64 {
            let seen = (0..out.seen.len()).filter(|i| out.seen[*i] == 1.0 && o.seen[*i] == 1.0);
            seen.map(|i| f64::from((o.radiance.data[3 * i] - map.data[3 * i]).powi(2))).sum()
        };
        assert!(apart(&other) > 4.0 * apart(&out) || distance == 12.0, "{distance}");
        let share = seen / (4.0 * std::f64::consts::PI);
        let least = if distance == 3.0 { 0.8 } else { 0.9 };
        assert!((least..1.0).contains(&share), "{distance}: {share}");
    }
}

#[test]
fn the_outline_is_found_within_a_pixel() {
    let map = light(64);
    for outline in [
        Outline { center: [170.3, 148.9], radius: 120.4 },
        Outline { center: [420.0, 210.5], radius: 77.0 },
    ] {
        let photo = picture(&map, &outline, f64::INFINITY, (640, 320));
        let found = find_ball(&photo).expect("a ball");
        let off = [0, 1].map(|k| (found.center[k] - outline.center[k]).abs());
        assert!(off[0].max(off[1]) < 1.0, "{found:?} {outline:?}");
        assert!((found.radius - outline.radius).abs() < 1.2, "{found:?} {outline:?}");
    }
    assert_eq!(find_ball(&ImageF32::filled(200, 200, 3, 0.4)), None);
}

#[test]
fn clipped_pixels_are_followed_to_the_map() {
    let outline = Outline { center: [50.0, 50.0], radius: 40.0 };
    let photo = ImageF32::filled(100, 100, 3, 0.5);
    let middle = 50 * 100 + 50;
    let out = unwrap(&photo, &outline, f64::INFINITY, Vec3::ONE, 32, &|i| i == middle);
    let clipped: Vec<usize> = (0..out.clipped.len()).filter(|i| out.clipped[*i]).collect();
    // The middle of the ball shows the camera: behind it, where the map has its seam.
    assert!(!clipped.is_empty() && clipped.iter().all(|i| [0, 1, 62, 63].contains(&(i % 64))));
}
