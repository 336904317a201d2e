//! The sRGB transfer function (IEC 61966-2-1), continued beyond 1 and mirrored below 0.

/// sRGB-encoded value of a linear one.
#[inline]
pub fn encode(linear: f32) -> f32 {
    let v = linear.abs();
    let encoded = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    encoded.copysign(linear)
}

/// Linear value of an sRGB-encoded one.
#[inline]
pub fn decode(encoded: f32) -> f32 {
    let v = encoded.abs();
    let linear = if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    linear.copysign(encoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decoding_undoes_encoding() {
        for i in -40..200 {
            let v = i as f32 / 100.0;
            assert!((decode(encode(v)) - v).abs() < 1e-5, "{v}");
        }
        assert!((encode(0.214_041) - 0.5).abs() < 1e-5);
    }
}
