//! How a color changes another, and how that shows on spherical harmonics.
//!
//! Shown colors are sRGB-encoded: `c = 0.5 + Y_0 sh_0 + Σ Y_k sh_k`. When the light that a point sends out changes by a factor
//! per channel, band 0 takes the new encoded mean, and the higher bands are scaled by the ratio of the encoded means: to
//! first order that is what the sRGB curve, nearly a power law, does to their variation.

use motes_math::luminance::luminance;
use motes_math::sh::SH_C0;
use motes_math::srgb;

/// How a color changes another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorMode {
    /// Hue and saturation of the given color, lightness as it is.
    Tint,
    /// Multiplied by the given factors.
    Gain,
    /// The given color; what varied around the mean still varies.
    #[default]
    Replace,
    /// The given color everywhere, as a material has it.
    Even,
}

/// A change of color, linear Rec. 709.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorChange {
    /// How.
    pub mode: ColorMode,
    /// The color, or the factors.
    pub rgb_linear: [f32; 3],
}

/// Factors on a shown color stay below: a black point has no color to multiply.
const DARKEST: f32 = 2e-3;

impl ColorChange {
    /// The color that `old` becomes, clamped to 0..1; `mean_luminance` is that of all that change together.
    pub fn apply(&self, old: [f32; 3], mean_luminance: f32) -> [f32; 3] {
        let rgb = self.rgb_linear;
        let scaled = |factor: f32| rgb.map(|v| v * factor);
        let new = match self.mode {
            ColorMode::Gain => [0, 1, 2].map(|c| old[c] * rgb[c]),
            ColorMode::Replace => scaled(ratio(luminance(old), mean_luminance)),
            ColorMode::Even => rgb,
            ColorMode::Tint => scaled(ratio(luminance(old), luminance(rgb))),
        };
        new.map(|v| v.max(0.0).clamp(0.0, 1.0))
    }
}

/// 1 where the divisor says nothing.
fn ratio(a: f32, b: f32) -> f32 {
    if b > 0.0 { a / b } else { 1.0 }
}

/// Mean shown color of coefficients, linear, 0 to 1.
pub fn shown_linear(sh: &[f32]) -> [f32; 3] {
    [0, 1, 2].map(|c| {
        let shown = 0.5 + sh[c] * SH_C0 as f32;
        srgb::decode(shown.max(0.0).clamp(0.0, 1.0))
    })
}

/// Changes coefficients so that their mean shown color is `new`, linear.
pub fn show_linear(sh: &mut [f32], new: [f32; 3]) {
    for (c, value) in new.into_iter().enumerate() {
        let old = (0.5 + sh[c] * SH_C0 as f32).max(srgb::encode(DARKEST));
        let encoded = srgb::encode(value.max(0.0).clamp(0.0, 1.0));
        let ratio = encoded / old;
        sh[c] = (encoded - 0.5) / SH_C0 as f32;
        sh[3..].iter_mut().skip(c).step_by(3).for_each(|v| *v *= ratio);
    }
}

/// Changes coefficients as if the light sent out were multiplied by `factors`, linear.
pub fn scale_shown(sh: &mut [f32], factors: [f32; 3]) {
    let old = shown_linear(sh);
    show_linear(sh, [0, 1, 2].map(|c| old[c] * factors[c]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_do_what_they_say() {
        let old = [0.2, 0.4, 0.1];
        let change = |mode, rgb_linear| ColorChange { mode, rgb_linear }.apply(old, luminance(old));
        assert_eq!(change(ColorMode::Gain, [2.0, 0.5, 20.0]), [0.4, 0.2, 1.0]);
        assert_eq!(change(ColorMode::Replace, [0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
        let even = ColorChange { mode: ColorMode::Even, rgb_linear: [0.1, 0.2, 0.3] };
        assert_eq!(even.apply(old, 0.01), [0.1, 0.2, 0.3]);
        let tinted = change(ColorMode::Tint, [0.5, 0.1, 0.1]);
        assert!((luminance(tinted) - luminance(old)).abs() < 1e-6, "{tinted:?}");
        assert!((tinted[0] / tinted[1] - 5.0).abs() < 1e-4);
        // Twice as bright as the mean stays twice as bright.
        let replaced = ColorChange { mode: ColorMode::Replace, rgb_linear: [0.1; 3] };
        assert!((replaced.apply([0.4; 3], 0.2)[0] - 0.2).abs() < 1e-6);
    }

    #[test]
    fn shown_colors_follow() {
        let mut sh: Vec<f32> = (0..12).map(|i| 0.1 + 0.05 * i as f32).collect();
        let before = sh.clone();
        scale_shown(&mut sh, [1.0; 3]);
        for (a, b) in sh.iter().zip(&before) {
            assert!((a - b).abs() < 1e-4, "{a} {b}");
        }
        show_linear(&mut sh, [0.5, 0.02, 0.0]);
        let shown = shown_linear(&sh);
        assert!((shown[0] - 0.5).abs() < 1e-4 && (shown[1] - 0.02).abs() < 1e-4, "{shown:?}");
        assert!(shown[2].abs() < 1e-4 && sh[5].abs() < 1e-4, "black does not vary: {sh:?}");
    }
}
