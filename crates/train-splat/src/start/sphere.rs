//! Photos taken from one place, laid on a sphere around it.

use glam::DVec3;
use motes_scene::SparsePoints;

use super::view::View;

/// Distance of the sphere, world units: far against any unsteadiness of the cameras.
const RADIUS: f64 = 10.0;

/// About `wanted` points in the directions of evenly spaced pixels of all photos.
pub(super) fn sphere_points(views: &[View], wanted: usize) -> SparsePoints {
    let mut points = SparsePoints::default();
    let pixels: usize = views.iter().map(|view| view.camera.width * view.camera.height).sum();
    let step = (pixels as f64 / wanted.max(1) as f64).sqrt().max(1.0);
    let taken = |side: usize, shift: f64| {
        let count = (side as f64 / step).round().max(1.0) as usize;
        (0..count).map(move |i| (i as f64 + shift) * side as f64 / count as f64)
    };
    for (i, view) in views.iter().enumerate() {
        // Photos of one direction take pixels between each other's: equal points have no width.
        let shift = |step: f64| (0.5 + i as f64 * step).fract();
        for y in taken(view.camera.height, shift(0.618_034)) {
            for x in taken(view.camera.width, shift(0.414_214)) {
                let place: DVec3 = view.center + RADIUS * view.ray(x, y).normalize();
                points.positions.push(place.as_vec3().to_array());
                points.colors.push(view.color(x as f32, y as f32));
            }
        }
    }
    points
}
