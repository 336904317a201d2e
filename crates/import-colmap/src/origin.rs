//! Moving the world origin near the cameras.

use glam::DVec3;
use motes_math::median::upper_median;

/// Offsets are subtracted when the cameras are farther from the origin than this many times
/// their own extent: single precision then has fewer than 5 digits left for the scene. A ratio, so
/// that the unit of the source does not matter.
const FAR_IN_EXTENTS: f64 = 1e2;
/// Cameras in one place have no extent; they are far away at this many units.
const FAR: f64 = 1e4;

/// The offset to subtract from world positions: zero unless the cameras are far from the origin
/// (map coordinates, say). It is the median camera center, rounded to a power of ten near the
/// extent of the cameras, so that it can be read and typed.
pub(crate) fn choose(centers: &[DVec3]) -> DVec3 {
    if centers.is_empty() {
        return DVec3::ZERO;
    }
    let median = DVec3::from_array(std::array::from_fn(|axis| {
        let mut values: Vec<f64> = centers.iter().map(|c| c[axis]).collect();
        upper_median(&mut values, f64::total_cmp).unwrap_or(0.0)
    }));
    let extent = centers.iter().map(|c| c.distance(median)).fold(0.0, f64::max);
    let distance = median.length();
    let far = distance > if extent > 0.0 { FAR_IN_EXTENTS * extent } else { FAR };
    if !far {
        return DVec3::ZERO;
    }
    let unit = if extent > 0.0 { 10f64.powf(extent.log10().floor()) } else { 1.0 };
    (median / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_near_the_origin_stays() {
        let ring: Vec<DVec3> =
            (0..8).map(|i| DVec3::new((i as f64).cos(), (i as f64).sin(), 0.3)).collect();
        assert_eq!(choose(&ring), DVec3::ZERO);
        assert_eq!(choose(&[DVec3::new(90.0, 0.0, 0.0), DVec3::new(91.0, 0.0, 0.0)]), DVec3::ZERO);
        assert_eq!(choose(&[]), DVec3::ZERO);
    }

    #[test]
    fn map_coordinates_are_moved_by_a_round_number() {
        let base = DVec3::new(4_512_345.678, 531_234.5, 87.25);
        let centers: Vec<DVec3> = (0..5).map(|i| base + DVec3::X * (i as f64 * 3.0)).collect();
        let origin = choose(&centers);
        assert!((origin - base).abs().max_element() < 13.0, "{origin}");
        assert_eq!(origin, origin.round());
    }

    #[test]
    fn a_small_scene_far_away_is_moved_too() {
        let centers = [DVec3::new(50.0, 0.0, 0.0), DVec3::new(50.02, 0.0, 0.0)];
        let origin = choose(&centers);
        assert!((origin - centers[0]).length() < 0.03, "{origin}");
    }
}
