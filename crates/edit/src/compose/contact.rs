//! The ground below an asset, and whether it touches it.

use glam::DVec3;
use motes_math::median::{median, weighted_median};
use motes_math::sigmoid::sigmoid;
use motes_scene::{Gaussians, Surface};
use motes_shading::tracing::{BuildQuality, MeshTracer, Ray, Tracer as _};

use crate::changes::ground::find_ground;
use crate::changes::measure::Extent;

/// Fainter Gaussians are no ground.
const LEAST_OPACITY: f32 = 0.1;
/// Ground on uneven land lies within this many half thicknesses of the plane.
const UNEVEN: f64 = 3.0;
/// Most that an asset is moved to touch it, over its height.
const MOST_SHIFT: f64 = 0.25;
/// Rays down from the footprint.
const RAYS: usize = 9;

/// An asset over ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Height of the ground below it along up, world units.
    pub ground: f64,
    /// Height of its lowest half percent over that; below 0 where it is sunk in.
    pub gap: f64,
    /// The shift along up that closes the gap; 0 where it is too wide to be an error of the place.
    pub shift: f64,
}

/// The contact of a placed asset of `extent` (world) with a scene: with its surface where it has one, else with the Gaussians of the ground;
/// `None` where there is no ground below it.
pub fn contact(
    scene: &Gaussians,
    surface: Option<&Surface>,
    up: DVec3,
    extent: &Extent,
) -> Option<Contact> {
    let slack = find_ground(scene, up).map(|ground| 2.0 * ground.half_thickness);
    let on_surface = surface.and_then(|surface| below_on(surface, up, extent));
    let height = on_surface.or_else(|| below_in(scene, up, extent))?;
    let gap = extent.bottom - height;
    let closes = gap.abs() <= MOST_SHIFT * extent.height() + slack.unwrap_or(0.0);
    Some(Contact { ground: height, gap, shift: if closes { -gap } else { 0.0 } })
}

/// Median height of the surface below a few points of the footprint.
fn below_on(surface: &Surface, up: DVec3, extent: &Extent) -> Option<f64> {
    let tracer = MeshTracer::new(&surface.into(), BuildQuality::Fast).ok()?;
    let (x, y) = up.any_orthonormal_pair();
    // From the lower part of the asset: what hangs over it is no ground.
    let start = extent.base() + up * (0.3 * extent.height());
    let height = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / RAYS as f64).sin_cos();
        let radius = if k == 0 { 0.0 } else { 0.3 * extent.footprint() };
        let from = start + (x * cos + y * sin) * radius;
        let hit = tracer.closest_hit(&Ray::new(from.as_vec3(), -up.as_vec3()))?;
        Some(from.dot(up) - f64::from(hit.distance))
    };
    median((0..RAYS).filter_map(height))
}

/// Weighted median height of the Gaussians of the ground under the footprint.
fn below_in(scene: &Gaussians, up: DVec3, extent: &Extent) -> Option<f64> {
    let ground = find_ground(scene, up)?;
    let base = extent.base();
    let radius = 0.5 * extent.footprint();
    // A plane without noise is thin: a dip is measured by what stands in it.
    let uneven = (UNEVEN * ground.half_thickness).max(0.1 * extent.height());
    let below = |row: usize| {
        let p = DVec3::from_array(scene.means[row].map(f64::from));
        let opacity = sigmoid(scene.opacity_logits[row]);
        let aside = (p - base).reject_from(up).length();
        let off = (p.dot(up) - ground.height).abs();
        let is_ground = aside < radius && off < uneven;
        (is_ground && opacity > LEAST_OPACITY).then(|| (p.dot(up) as f32, opacity))
    };
    let heights: Vec<(f32, f32)> = (0..scene.len()).filter_map(below).collect();
    Some(weighted_median(heights).map_or(ground.height, f64::from))
}

/// Lowest and highest vertex of a surface along `up`, its units; `None` where it has none.
pub fn heights(surface: &Surface, up: DVec3) -> Option<(f64, f64)> {
    let along = surface.vertices.iter().map(|v| DVec3::from_array(v.map(f64::from)).dot(up));
    let range = along
        .filter(|h| h.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)));
    (range.0 <= range.1).then_some(range)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor that is a little lower around (1, 0).
    fn floor() -> Gaussians {
        let n = 60;
        let mut gaussians = motes_testkit::random_gaussians(1, n * n, 0);
        for i in 0..n * n {
            let (x, y) = ((i % n) as f32 / 15.0 - 2.0, (i / n) as f32 / 15.0 - 2.0);
            let z = if (x - 1.0).hypot(y) < 0.6 { -0.01 } else { 0.0 };
            gaussians.means[i] = [x, y, z];
            gaussians.rotations[i] = [1.0, 0.0, 0.0, 0.0];
            gaussians.log_scales[i] = [-3.0, -3.0, -6.0];
            gaussians.opacity_logits[i] = 3.0;
        }
        gaussians
    }

    fn block(x: f32, bottom: f32) -> Extent {
        let mut gaussians = motes_testkit::random_gaussians(2, 400, 0);
        for i in 0..400 {
            let (a, b, c) = ((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32);
            gaussians.means[i] = [x + a * 0.04 - 0.2, b * 0.04 - 0.2, bottom + c * 0.1];
            gaussians.opacity_logits[i] = 3.0;
        }
        let rows: Vec<u32> = (0..400).collect();
        Extent::of(&gaussians, &rows, DVec3::Z).unwrap()
    }

    #[test]
    fn gaps_are_measured_where_the_asset_stands_and_closed() {
        let scene = floor();
        let over = contact(&scene, None, DVec3::Z, &block(-1.0, 0.05)).unwrap();
        assert!((over.gap - 0.05).abs() < 2e-3 && (over.shift + 0.05).abs() < 2e-3, "{over:?}");
        let lower = contact(&scene, None, DVec3::Z, &block(1.0, 0.0)).unwrap();
        assert!((lower.gap - 0.01).abs() < 2e-3, "{lower:?}");
        let flat = Surface {
            vertices: vec![[-9.0, -9.0, 0.02], [9.0, -9.0, 0.02], [0.0, 9.0, 0.02]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            triangles: vec![[0, 1, 2]],
            ..Surface::default()
        };
        let traced = contact(&scene, Some(&flat), DVec3::Z, &block(-1.0, 0.05)).unwrap();
        assert!((traced.gap - 0.03).abs() < 1e-5, "{traced:?}");
        let hanging = contact(&scene, None, DVec3::Z, &block(-1.0, 1.5)).unwrap();
        assert!((hanging.gap - 1.5).abs() < 2e-3 && hanging.shift == 0.0, "{hanging:?}");
        assert_eq!(contact(&Gaussians::empty(0), None, DVec3::Z, &block(0.0, 0.0)), None);
    }
}
