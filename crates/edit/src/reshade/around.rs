//! The surface around an object, as points.

use glam::Vec3;
use motes_math::rng::keyed_rng;
use motes_scene::Surface;
use rand::RngExt;

use super::height_field::Oriented;

/// Points that are drawn.
const POINTS: usize = 16_384;
const PURPOSE: u64 = 0x484f_4c45;

/// Points of triangles that stayed, evenly spread over their area, within a ball.
pub(super) fn points_around(
    surface: &Surface,
    stays: &impl Fn(u32) -> bool,
    (center, radius): (Vec3, f32),
    seed: u64,
) -> Vec<Oriented> {
    let corners = |t: &[u32; 3]| t.map(|v| Vec3::from(surface.vertices[v as usize]));
    let near = |t: &&[u32; 3]| {
        let [a, b, c] = corners(t);
        let middle = (a + b + c) / 3.0;
        let reach = a.distance(middle).max(b.distance(middle)).max(c.distance(middle));
        t.iter().all(|v| stays(*v)) && middle.distance(center) <= radius + reach
    };
    let triangles: Vec<[u32; 3]> = surface.triangles.iter().filter(near).copied().collect();
    // A triangle much larger than the ball shall not draw all points to where it is far away.
    let most = radius * radius;
    let mut sum = 0.0f64;
    let areas: Vec<f64> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            sum += f64::from((0.5 * (b - a).cross(c - a).length()).min(most));
            sum
        })
        .collect();
    if !(sum > 0.0) {
        return Vec::new();
    }
    let mut rng = keyed_rng(seed, PURPOSE, 0);
    let draw = |_| {
        let share = rng.random_range(0.0..sum);
        let at = areas.partition_point(|a| *a < share);
        let triangle = &triangles[at.min(triangles.len() - 1)];
        let [a, b, c] = corners(triangle);
        let (mut u, mut v): (f32, f32) = (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0));
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let normal = (b - a).cross(c - a).normalize_or_zero();
        // Its vertices know which side is out.
        let out = triangle.iter().map(|v| Vec3::from(surface.normals[*v as usize])).sum::<Vec3>();
        let normal = if normal.dot(out) < 0.0 { -normal } else { normal };
        Oriented { point: a + (b - a) * u + (c - a) * v, normal }
    };
    (0..POINTS).map(draw).filter(|o| o.point.distance(center) <= radius).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_as_many_as_a_triangle_is_large() {
        // Strips of triangles, each twice as high as the one before, chi-square with 5.
        let mut surface = Surface::default();
        for k in 0..6 {
            let height = 0.01 * 2.0f32.powi(k);
            let x = 0.1 * k as f32;
            for corner in [[x, 0.0, 0.0], [x + 0.1, 0.0, 0.0], [x, height, 0.0]] {
                surface.vertices.push(corner);
                surface.normals.push([0.0, 0.0, 1.0]);
            }
            surface.triangles.push([0, 1, 2].map(|v| 3 * k as u32 + v));
        }
        let points = points_around(&surface, &|_| true, (Vec3::ZERO, 10.0), 5);
        assert_eq!(points.len(), POINTS);
        let mut counts = [0.0f64; 6];
        points.iter().for_each(|o| counts[(o.point.x / 0.1) as usize] += 1.0);
        let expected = |k: usize| POINTS as f64 * 2.0f64.powi(k as i32) / 63.0;
        let chi2: f64 = (0..6).map(|k| (counts[k] - expected(k)).powi(2) / expected(k)).sum();
        assert!(chi2 < 20.5, "{counts:?}: {chi2}, beyond the 0.1 % point");
        assert!(points.iter().all(|o| o.normal == Vec3::Z));
        assert!(points_around(&surface, &|_| false, (Vec3::ZERO, 10.0), 5).is_empty());
    }
}
