//! A perceptually ordered color map: equal steps of value are equal steps of lightness.
//!
//! Lightness `L` of Oklab rises linearly from near black to near white while the hue walks from
//! blue over red to yellow, so the order survives grayscale printing and color-blind eyes.
//! Source: Ottosson, "A perceptual color space for image processing" (2020).

use std::f64::consts::TAU;

use motes_math::srgb::encode_f64;

/// Color of `t` in [0, 1], 8-bit sRGB; values outside are clamped, NaN is mid-gray.
pub fn colormap(t: f64) -> [u8; 3] {
    if t.is_nan() {
        return [128; 3];
    }
    let t = t.clamp(0.0, 1.0);
    let lightness = 0.12 + 0.85 * t;
    // Chroma vanishes at both ends, where sRGB has little room for color.
    let chroma = 0.17 * (1.0 - (2.0 * t - 1.0).abs().powf(2.5));
    let hue = TAU * (0.76 + 0.50 * t);
    oklab_to_srgb8(lightness, chroma * hue.cos(), chroma * hue.sin())
}

fn oklab_to_srgb8(lightness: f64, a: f64, b: f64) -> [u8; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
    .map(|linear| (encode_f64(linear.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use motes_math::srgb::decode_f64;

    use super::*;

    /// CIE L* of an 8-bit sRGB color: another lightness than the one the map is built on.
    fn lightness(rgb: [u8; 3]) -> f64 {
        let linear = rgb.map(|v| decode_f64(f64::from(v) / 255.0));
        let y = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
        if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
    }

    #[test]
    fn lightness_rises_everywhere_at_an_even_pace() {
        let values: Vec<f64> = (0..=32).map(|i| lightness(colormap(f64::from(i) / 32.0))).collect();
        for pair in values.windows(2) {
            let step = pair[1] - pair[0];
            assert!((0.8..6.5).contains(&step), "{values:?}");
        }
        assert!(values[0] < 6.0 && values[32] > 93.0, "{values:?}");
    }

    #[test]
    fn bad_values_have_a_color() {
        assert_eq!(colormap(f64::NAN), [128; 3]);
        assert_eq!(colormap(-3.0), colormap(0.0));
        assert_eq!(colormap(f64::INFINITY), colormap(1.0));
    }
}
