//! Relative luminance of linear Rec. 709 color (ITU-R BT.709-6, item 3.2).

/// Weights of red, green and blue; their sum is 1.
pub const REC_709: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Luminance of a linear color, in its units.
#[inline]
pub fn luminance(rgb: impl Into<[f32; 3]>) -> f32 {
    let [r, g, b] = rgb.into();
    r * REC_709[0] as f32 + g * REC_709[1] as f32 + b * REC_709[2] as f32
}

/// [`luminance`] in double precision.
#[inline]
pub fn luminance_f64(rgb: impl Into<[f64; 3]>) -> f64 {
    let [r, g, b] = rgb.into();
    r * REC_709[0] + g * REC_709[1] + b * REC_709[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_has_the_luminance_of_its_channels() {
        assert!((luminance_f64([3.0; 3]) - 3.0).abs() < 1e-12);
        assert!((luminance([3.0; 3]) - 3.0).abs() < 1e-6);
    }

    #[test]
    fn single_precision_weights_are_the_nearest() {
        assert_eq!(REC_709.map(|w| w as f32), [0.2126_f32, 0.7152, 0.0722]);
    }

    #[test]
    fn green_is_brighter_than_red_and_red_than_blue() {
        let of = |channel: usize| {
            luminance(std::array::from_fn::<f32, 3, _>(|k| f32::from(u8::from(k == channel))))
        };
        assert!(of(1) > of(0) && of(0) > of(2));
    }
}
