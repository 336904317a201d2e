//! Lat-long pictures as functions on the sphere.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use motes_scene::ImageF32;
use motes_shading::environment::{direction_from_uv, uv_from_direction};

/// Solid angle of one texel of row `y` of `height`, with `width` columns; steradian.
pub fn texel_solid_angle(y: usize, width: usize, height: usize) -> f64 {
    let edge = |y: usize| (PI * y as f64 / height as f64).cos();
    TAU * (edge(y) - edge(y + 1)) / width as f64
}

/// Unit vector to the middle of a texel, in the axes of the map.
pub fn texel_direction(x: usize, y: usize, width: usize, height: usize) -> DVec3 {
    direction_from_uv((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64)
}

/// The texel that a direction (axes of the map) falls into.
pub fn texel_of(direction: DVec3, width: usize, height: usize) -> (usize, usize) {
    let (u, v) = uv_from_direction(direction);
    let at = |t: f64, n: usize| ((t * n as f64).max(0.0) as usize).min(n - 1);
    (at(u, width), at(v, height))
}

/// Value in a direction (axes of the map): bilinear, wrapped around, clamped at the poles.
pub fn look_up(map: &ImageF32, direction: DVec3) -> Vec3 {
    let (u, v) = uv_from_direction(direction);
    let (w, h) = (map.width as i64, map.height as i64);
    let (x, y) = (u * w as f64 - 0.5, v * h as f64 - 0.5);
    let (s, t) = ((x - x.floor()) as f32, (y - y.floor()) as f32);
    let texel = |dx: i64, dy: i64| {
        let column = (x.floor() as i64 + dx).rem_euclid(w) as usize;
        let row = (y.floor() as i64 + dy).clamp(0, h - 1) as usize;
        Vec3::from_slice(map.pixel(column, row))
    };
    texel(0, 0).lerp(texel(1, 0), s).lerp(texel(0, 1).lerp(texel(1, 1), s), t)
}

/// `n` directions that cover the sphere evenly (a spherical Fibonacci lattice); unit vectors.
pub fn even_directions(n: usize) -> Vec<DVec3> {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    let direction = |i: usize| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let (sin, cos) = (GOLDEN_ANGLE * i as f64).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * cos, r * sin, z)
    };
    (0..n).map(direction).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_add_up_to_the_sphere_and_directions_find_their_texel() {
        let sum: f64 = (0..8).map(|y| 16.0 * texel_solid_angle(y, 16, 8)).sum();
        assert!((sum - 4.0 * PI).abs() < 1e-12);
        for (x, y) in [(0, 0), (15, 7), (5, 3)] {
            assert_eq!(texel_of(texel_direction(x, y, 16, 8), 16, 8), (x, y));
        }
        assert!(even_directions(100).iter().copied().sum::<DVec3>().length() < 2.0);
    }

    #[test]
    fn values_between_texels_are_means_also_over_the_seam() {
        let mut map = ImageF32::filled(4, 2, 3, 0.0);
        map.pixel_mut(0, 0).fill(1.0);
        let seam = direction_from_uv(0.0, 0.25);
        assert!((look_up(&map, seam).x - 0.5).abs() < 1e-6);
        assert!((look_up(&map, texel_direction(0, 0, 4, 2)).x - 1.0).abs() < 1e-6);
    }
}
