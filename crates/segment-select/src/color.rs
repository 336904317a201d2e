//! CIE L*a*b* of sRGB-encoded colors: differences that people see as equal are about equal.

use motes_math::srgb::decode;

/// L*a*b* (D65, 2 degrees) of an sRGB-encoded color; values outside 0 to 1 are clamped.
pub fn lab_from_srgb(rgb: [f32; 3]) -> [f32; 3] {
    // `max` first: it turns NaN into 0, `clamp` would keep it.
    let [r, g, b] = rgb.map(|v| decode(v.max(0.0).clamp(0.0, 1.0)));
    // IEC 61966-2-1, divided by the white point.
    let x = (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47;
    let y = 0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b;
    let z = (0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / 1.088_83;
    let f = |t: f32| if t > 0.008_856_452 { t.cbrt() } else { 7.787_037 * t + 16.0 / 116.0 };
    let (x, y, z) = (f(x), f(y), f(z));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Euclidean difference of two L*a*b* colors (CIE76).
pub fn difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f32>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colors() {
        for (rgb, lab) in [
            ([1.0, 1.0, 1.0], [100.0, 0.0, 0.0]),
            ([1.0, 0.0, 0.0], [53.24, 80.09, 67.20]),
            ([0.0, 0.0, 1.0], [32.30, 79.19, -107.86]),
        ] {
            assert!(difference(lab_from_srgb(rgb), lab) < 0.05, "{rgb:?}");
        }
        assert!(lab_from_srgb([f32::NAN; 3]).iter().all(|v| v.is_finite()));
    }
}
