//! Values of every pixel in half precision: those of all photos are kept at once.

use glam::Vec3;
use half::f16;

/// Exponent that the largest value has when it is stored: numbers of half precision end at 2^16, and lose digits below 2^-14.
const LARGEST: i32 = 14;

/// Three values per pixel in half precision, times one power of two.
///
/// The power is that which makes use of the range, so any exposure of the photos is stored with an error of 2^-11 at most, down to
/// 2^-28 of the largest value. Values that were stored are stored again without a change.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HalfPixels {
    values: Vec<[f16; 3]>,
    scale: f32,
}

impl HalfPixels {
    /// Stores these values.
    pub(crate) fn new(values: impl ExactSizeIterator<Item = Vec3> + Clone) -> Self {
        let finite = |v: Vec3| v.abs().to_array().into_iter().filter(|v| v.is_finite());
        let largest = values.clone().flat_map(finite).fold(0.0, f32::max);
        let scale = scale_of(largest);
        let by = scale.recip();
        let halves = |v: Vec3| (v * by).to_array().map(f16::from_f32);
        Self { values: values.map(halves).collect(), scale }
    }

    /// Number of pixels.
    pub(super) fn count(&self) -> usize {
        self.values.len()
    }

    /// The values of pixel `i`.
    pub(crate) fn at(&self, i: usize) -> Vec3 {
        Vec3::from_array(self.values[i].map(f16::to_f32)) * self.scale
    }
}

/// The power of two that the stored values are multiplied by.
fn scale_of(largest: f32) -> f32 {
    if largest == 0.0 {
        return 1.0;
    }
    // Half an ulp of half precision more: what is rounded up to a power of two has that exponent when it is stored again.
    let exponent = (f64::from(largest) * (1.0 + f64::powi(2.0, -11))).log2().floor() as i32;
    2.0_f32.powi((exponent - LARGEST).clamp(-126, 126))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stored(values: &[Vec3]) -> HalfPixels {
        HalfPixels::new(values.iter().copied())
    }

    #[test]
    fn any_exposure_is_kept_and_kept_again() {
        for exposure in [1e-30, 1e-6, 0.3, 1.0, 1e6, 1e30] {
            let of = |k: u32| Vec3::new(1.0, 1.9996, 0.37) * 1.37_f32.powi(-(k as i32)) * exposure;
            let values: Vec<Vec3> = (0..40).map(of).collect();
            let first = stored(&values);
            for (i, value) in values.iter().enumerate() {
                let off = (first.at(i) - *value).abs() / *value;
                assert!(off.max_element() < 4.9e-4, "{exposure} {i}: {off}");
            }
            let read: Vec<Vec3> = (0..first.count()).map(|i| first.at(i)).collect();
            let again = stored(&read);
            for (i, value) in read.iter().enumerate() {
                assert_eq!(again.at(i), *value, "{exposure} {i}");
            }
        }
    }

    #[test]
    fn nothing_and_what_is_no_number_are_stored() {
        assert_eq!(stored(&[]).count(), 0);
        assert_eq!(stored(&[Vec3::ZERO; 2]).at(1), Vec3::ZERO);
        let odd = stored(&[Vec3::new(f32::NAN, f32::INFINITY, 0.5)]);
        assert!(odd.at(0).x.is_nan() && odd.at(0).y.is_infinite() && odd.at(0).z == 0.5);
        assert_eq!(stored(&[Vec3::splat(f32::MAX), Vec3::ZERO]).at(1), Vec3::ZERO);
    }

    #[test]
    fn values_that_round_up_to_a_power_of_two_keep_their_digits() {
        let values = [Vec3::splat(1.999_95), Vec3::splat(3.1e-9), Vec3::splat(7.7e-9)];
        let first = stored(&values);
        let read: Vec<Vec3> = (0..3).map(|i| first.at(i)).collect();
        let again = stored(&read);
        assert!((0..3).all(|i| again.at(i) == read[i]));
    }
}
