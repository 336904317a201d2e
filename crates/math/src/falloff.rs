//! A smooth step from full to nothing, for how far something counts by how far off it is.

/// `peak / (1 + (error / scale)⁴)`: flat about 0, half of `peak` where the error reaches `scale`, and gone at some multiples of it; the
/// power response of a second-order Butterworth filter. `error` of either sign, `scale` not negative, `peak` finite.
///
/// An infinite error leaves nothing, and so does one that is NaN, which a scale of 0 makes of an error of 0.
#[inline]
pub fn quartic_falloff(peak: f32, error: f32, scale: f32) -> f32 {
    let squared = (error / scale).powi(2);
    // Written so that NaN counts for nothing.
    if squared >= 0.0 { peak / (1.0 + squared * squared) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_is_left_at_the_scale_and_nothing_far_from_it() {
        let of = |error| quartic_falloff(1.0, error, 0.5);
        assert_eq!([0.0, 0.5, -0.5, 1.0].map(of), [1.0, 0.5, 0.5, 1.0 / 17.0]);
        assert!(of(0.1) > 0.998 && of(5.0) < 2e-4, "{} {}", of(0.1), of(5.0));
        assert_eq!(quartic_falloff(0.6, 0.5, 0.5), 0.3);
        assert!((1..100).all(|i| of(0.01 * i as f32) <= of(0.01 * (i - 1) as f32)));
    }

    #[test]
    fn the_bytes_are_those_of_the_formula() {
        let scale = 0.35f32;
        for i in -2000..2000i32 {
            // What a compiler computes beforehand is rounded once.
            let i = std::hint::black_box(i);
            let (error, peak) = (0.0137 * i as f32, 1.0 - 1e-4 * i.abs() as f32);
            let formula = peak / (1.0 + (error / scale).powi(4));
            assert_eq!(quartic_falloff(peak, error, scale).to_bits(), formula.to_bits(), "{error}");
        }
    }

    #[test]
    fn what_is_no_number_or_without_bounds_counts_for_nothing() {
        for error in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
            assert_eq!(quartic_falloff(1.0, error, 1.0), 0.0, "{error}");
        }
        assert_eq!([0.0, 1e-30, 1.0].map(|error| quartic_falloff(1.0, error, 0.0)), [0.0; 3]);
        assert_eq!(quartic_falloff(1.0, 1.0, f32::NAN), 0.0);
        assert_eq!(quartic_falloff(1.0, 3.0, f32::INFINITY), 1.0);
    }
}
