//! The ground below an asset, and whether it touches it.

use glam::DVec3;
use motes_math::median::weighted_median;
use motes_math::sigmoid::sigmoid;
use motes_scene::{Gaussians, Surface};

use crate::changes::ground::{Ground, find_ground};
use crate::changes::measure::Extent;

/// Fainter Gaussians are no ground.
const LEAST_OPACITY: f32 = 0.1;
/// Ground on uneven land lies within this many half thicknesses of the plane.
const UNEVEN: f64 = 3.0;
/// Most that an asset is moved to touch it, over its height.
const MOST_SHIFT: f64 = 0.25;

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

/// The contact of a placed asset of `extent` (world) with the Gaussians of a scene; `None` where there is no ground below it.
pub fn contact(scene: &Gaussians, up: DVec3, extent: &Extent) -> Option<Contact> {
    let ground = find_ground(scene, up)?;
    let base = extent.base();
    let radius = 0.5 * extent.footprint();
    let below = |row: usize| {
        let p = DVec3::from_array(scene.means[row].map(f64::from));
        let opacity = sigmoid(scene.opacity_logits[row]);
        let aside = (p - base).reject_from(up).length();
        let off = (p.dot(up) - ground.height).abs();
        let is_ground = aside < radius && off < UNEVEN * ground.half_thickness;
        (is_ground && opacity > LEAST_OPACITY).then(|| (p.dot(up) as f32, opacity))
    };
    let heights: Vec<(f32, f32)> = (0..scene.len()).filter_map(below).collect();
    let height = weighted_median(heights).map_or(ground.height, f64::from);
    let gap = extent.bottom - height;
    let closes = gap.abs() <= MOST_SHIFT * extent.height() + ground_slack(&ground);
    Some(Contact { ground: height, gap, shift: if closes { -gap } else { 0.0 } })
}

/// Lowest and highest vertex of a surface along `up`, its units; `None` where it has none.
pub fn heights(surface: &Surface, up: DVec3) -> Option<(f64, f64)> {
    let along = surface.vertices.iter().map(|v| DVec3::from_array(v.map(f64::from)).dot(up));
    let range = along
        .filter(|h| h.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)));
    (range.0 <= range.1).then_some(range)
}

fn ground_slack(ground: &Ground) -> f64 {
    2.0 * ground.half_thickness
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
        let over = contact(&scene, DVec3::Z, &block(-1.0, 0.05)).unwrap();
        assert!((over.gap - 0.05).abs() < 2e-3 && (over.shift + 0.05).abs() < 2e-3, "{over:?}");
        let lower = contact(&scene, DVec3::Z, &block(1.0, 0.0)).unwrap();
        assert!((lower.gap - 0.01).abs() < 2e-3, "{lower:?}");
        let hanging = contact(&scene, DVec3::Z, &block(-1.0, 1.5)).unwrap();
        assert!((hanging.gap - 1.5).abs() < 2e-3 && hanging.shift == 0.0, "{hanging:?}");
        assert_eq!(contact(&Gaussians::empty(0), DVec3::Z, &block(0.0, 0.0)), None);
    }
}
