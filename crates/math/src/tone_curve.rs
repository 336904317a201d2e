//! The tone curve of a camera: what it does to sRGB-encoded values after the sRGB curve.
//!
//! Pictures as cameras show them have more contrast in the middle than the sRGB curve gives, and less at both ends. One number says how
//! much:
//!
//! ```text
//! T(v) = v + contrast (3 v² - 2 v³ - v),   0 <= v <= 1
//! ```
//!
//! Black, one half and white stay; the slope is `1 + contrast / 2` at one half and `1 - contrast` at the ends. Above 1 and below 0 values
//! stay as they are.

/// A tone curve; the default changes nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToneCurve {
    contrast: f32,
}

impl ToneCurve {
    /// Contrasts that are undone: at 1 the ends would be flat and nothing could be read there; at the bound, noise at the ends grows to
    /// 2.5 times.
    pub const RANGE: [f32; 2] = [-0.5, 0.6];

    /// The curve of a contrast, within [`Self::RANGE`]; NaN is no contrast.
    pub fn new(contrast: f32) -> Self {
        let contrast = if contrast.is_nan() { 0.0 } else { contrast };
        Self { contrast: contrast.clamp(Self::RANGE[0], Self::RANGE[1]) }
    }

    /// The contrast.
    pub fn contrast(self) -> f32 {
        self.contrast
    }

    /// Whether it changes nothing.
    pub fn is_identity(self) -> bool {
        self.contrast == 0.0
    }

    /// What a camera shows for an sRGB-encoded value of the light.
    pub fn apply(self, v: f32) -> f32 {
        if !(v > 0.0 && v < 1.0) {
            return v;
        }
        v + self.contrast * (v * v * (3.0 - 2.0 * v) - v)
    }

    /// The sRGB-encoded value of the light that a camera shows as `shown`.
    pub fn invert(self, shown: f32) -> f32 {
        if self.is_identity() || !(shown > 0.0 && shown < 1.0) {
            return shown;
        }
        let c = f64::from(self.contrast);
        let target = f64::from(shown);
        // Newton's method between bounds; the curve rises everywhere.
        let (mut low, mut high, mut v) = (0.0, 1.0, target);
        for _ in 0..24 {
            let error = v + c * (v * v * (3.0 - 2.0 * v) - v) - target;
            if error.abs() < 1e-9 {
                break;
            }
            if error > 0.0 {
                high = v;
            } else {
                low = v;
            }
            let next = v - error / (1.0 + c * (6.0 * v * (1.0 - v) - 1.0));
            v = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        v as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_undoes_the_curve() {
        for contrast in [-0.5, -0.1, 0.0, 0.3, 0.5, 0.6] {
            let curve = ToneCurve::new(contrast);
            let mut before = -1.0;
            for i in 0..=1000 {
                let v = i as f32 / 1000.0;
                let shown = curve.apply(v);
                assert!(shown > before, "{contrast} {v}");
                before = shown;
                assert!((curve.invert(shown) - v).abs() < 2e-6, "{contrast} {v}");
            }
            for v in [0.0, 0.5, 1.0] {
                assert!((curve.apply(v) - v).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn what_is_no_picture_stays() {
        let curve = ToneCurve::new(0.5);
        for v in [-1.0, 1.5, 1e30, f32::INFINITY] {
            assert_eq!((curve.apply(v), curve.invert(v)), (v, v));
        }
        assert!(curve.apply(f32::NAN).is_nan() && curve.invert(f32::NAN).is_nan());
        assert!(ToneCurve::new(f32::NAN).is_identity());
        assert_eq!(ToneCurve::new(9.0).contrast(), ToneCurve::RANGE[1]);
        assert!(ToneCurve::default().is_identity());
        assert_eq!(ToneCurve::default().invert(0.3), 0.3);
    }
}
