//! The sRGB transfer function (IEC 61966-2-1), continued beyond 1 and mirrored below 0.

/// sRGB-encoded value of a linear one.
#[inline]
pub fn encode(linear: f32) -> f32 {
    let v = linear.abs();
    let encoded = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    encoded.copysign(linear)
}

/// [`encode`] in double precision.
#[inline]
pub fn encode_f64(linear: f64) -> f64 {
    let v = linear.abs();
    let encoded = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    encoded.copysign(linear)
}

/// [`encode`] of a linear value that is cut to [0, 1] first, as pictures are; NaN becomes 0.
#[inline]
pub fn encode_clipped(linear: f32) -> f32 {
    // `max` first: it turns NaN into 0.
    encode(linear.max(0.0).clamp(0.0, 1.0))
}

/// Linear value of an sRGB-encoded one.
#[inline]
pub fn decode(encoded: f32) -> f32 {
    let v = encoded.abs();
    let linear = if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    linear.copysign(encoded)
}

/// [`decode`] in double precision.
#[inline]
pub fn decode_f64(encoded: f64) -> f64 {
    let v = encoded.abs();
    let linear = if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    linear.copysign(encoded)
}

/// [`encode`] of a linear value and its derivative there. Below 0 the straight piece goes on.
#[inline]
pub fn encode_with_slope(linear: f32) -> (f32, f32) {
    if linear <= 0.003_130_8 {
        return (12.92 * linear, 12.92);
    }
    let power = linear.powf(1.0 / 2.4);
    (1.055 * power - 0.055, 1.055 / 2.4 * power / linear)
}

/// [`decode`] of an sRGB-encoded value and its derivative there. Below 0 the straight piece goes on.
#[inline]
pub fn decode_with_slope(encoded: f32) -> (f32, f32) {
    if encoded <= 0.040_45 {
        return (encoded / 12.92, 1.0 / 12.92);
    }
    let t = (encoded + 0.055) / 1.055;
    let power = t.powf(1.4);
    (power * t, 2.4 / 1.055 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_curves() {
        for v in [1e-3f32, 0.003, 0.02, 0.05, 0.4, 1.0, 3.0] {
            let check = |curve: &dyn Fn(f32) -> f32, (value, slope): (f32, f32)| {
                let h = 0.01 * v;
                let numeric = (curve(v + h) - curve(v - h)) / (2.0 * h);
                assert!((value - curve(v)).abs() <= 1e-6 * value.max(1.0), "{v}: {value}");
                assert!((slope - numeric).abs() < 2e-3 * slope, "{v}: {slope} {numeric}");
            };
            check(&encode, encode_with_slope(v));
            check(&decode, decode_with_slope(v));
        }
        assert_eq!(encode_with_slope(-1.0), (-12.92, 12.92));
    }

    #[test]
    fn decoding_undoes_encoding() {
        for i in -40..200 {
            let v = i as f32 / 100.0;
            assert!((decode(encode(v)) - v).abs() < 1e-5, "{v}");
            let v = f64::from(v);
            assert!((decode_f64(encode_f64(v)) - v).abs() < 1e-6, "{v}");
        }
        assert!((encode(0.214_041) - 0.5).abs() < 1e-5);
    }
}
