//! Leaving a surface without meeting it again.

use glam::Vec3;

/// Moves a point along the geometric normal, to the side that `direction` leaves by, past the
/// rounding of its own coordinates and by `bias` world units more.
///
/// Wächter & Binder, "A Fast and Robust Method for Avoiding Self-Intersection" (Ray Tracing
/// Gems, 2019): 256 units in the last place, a fixed step below 1/32. `bias` covers what the
/// caller knows: a point from a depth map is off its mesh by more than rounding.
#[inline]
pub fn offset_origin(point: Vec3, geometric_normal: Vec3, direction: Vec3, bias: f32) -> Vec3 {
    let outward =
        if geometric_normal.dot(direction) < 0.0 { -geometric_normal } else { geometric_normal };
    let step = |p: f32, n: f32| {
        if p.abs() < 1.0 / 32.0 {
            p + n / 65536.0
        } else {
            let ulps = (256.0 * n) as i32;
            let bits = (p.to_bits() as i32).wrapping_add(if p < 0.0 { -ulps } else { ulps });
            f32::from_bits(bits as u32)
        }
    };
    let moved =
        Vec3::new(step(point.x, outward.x), step(point.y, outward.y), step(point.z, outward.z));
    moved + outward * bias
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_point_moves_to_the_side_that_the_ray_leaves_by() {
        for scale in [1e-6, 1e-2, 1.0, 1e4] {
            for (p, n) in [
                (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.6, 0.0, 0.8)),
                (Vec3::new(-1.0, -2.0, -3.0), Vec3::new(-0.48, 0.6, -0.64)),
            ] {
                let p = p * scale;
                let there = offset_origin(p, n, n, 0.0) - p;
                let back = offset_origin(p, n, -n, 0.0) - p;
                assert!(there.dot(n) > 0.0 && back.dot(n) < 0.0, "{there} {back}");
                assert!(there.length() < 4e-4 * scale.max(0.1), "{there}");
            }
        }
        let biased = offset_origin(Vec3::ONE, Vec3::Z, Vec3::Z, 0.5);
        assert!((biased.z - 1.5).abs() < 1e-3);
    }
}
