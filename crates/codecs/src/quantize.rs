//! Values as integers of few bits, shared by several formats.

use motes_formats::ply::SH_C0;

/// Logits of the opacities 0 and 1 as 8-bit formats mean them: those of a quarter of a step from
/// the end, ln(1019). Finite, so that a stage may fit them further.
const OPAQUE_LOGIT: f32 = 6.926_577;

pub(crate) fn sigmoid(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit).exp())
}

/// The byte of a value from 0 to 1, nearest. NaN is 0.
pub(crate) fn unorm8(value: f32) -> u8 {
    (value * 255.0 + 0.5) as u8 // saturates
}

/// The integer of `bits` bits of a value from 0 to 1, nearest.
pub(crate) fn unorm(value: f32, bits: u32) -> u32 {
    let most = (1u32 << bits) - 1;
    ((value * most as f32 + 0.5) as u32).min(most)
}

/// The value from 0 to 1 of the lowest `bits` bits.
pub(crate) fn from_unorm(packed: u32, bits: u32) -> f32 {
    let most = (1u32 << bits) - 1;
    (packed & most) as f32 / most as f32
}

/// The logit of an 8-bit opacity.
pub(crate) fn logit_of_byte(byte: u8) -> f32 {
    match byte {
        0 => -OPAQUE_LOGIT,
        255 => OPAQUE_LOGIT,
        _ => {
            let opacity = f32::from(byte) / 255.0;
            (opacity / (1.0 - opacity)).ln()
        }
    }
}

/// The byte of the degree-0 color of a coefficient.
pub(crate) fn color_byte(dc: f32) -> u8 {
    unorm8(0.5 + SH_C0 * dc)
}

/// The degree-0 coefficient of a color from 0 to 1.
pub(crate) fn dc_of_color(color: f32) -> f32 {
    (color - 0.5) / SH_C0
}

/// `w, x, y, z` with norm 1; the identity when it has no direction.
pub(crate) fn unit(rotation: [f32; 4]) -> [f32; 4] {
    let norm2: f64 = rotation.iter().map(|&q| f64::from(q) * f64::from(q)).sum();
    if !(norm2 > 0.0 && norm2.is_finite()) {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let scale = norm2.sqrt().recip();
    rotation.map(|q| (f64::from(q) * scale) as f32)
}

/// The index of the component of largest magnitude, and the others in order with the sign that
/// makes it positive.
pub(crate) fn smallest_three(rotation: [f32; 4]) -> (usize, [f32; 3]) {
    let mut largest = 0;
    for i in 1..4 {
        if rotation[i].abs() > rotation[largest].abs() {
            largest = i;
        }
    }
    let sign = if rotation[largest] < 0.0 { -1.0 } else { 1.0 };
    let mut others = [0.0; 3];
    let rest = rotation.iter().enumerate().filter(|(i, _)| *i != largest);
    for (to, (_, from)) in others.iter_mut().zip(rest) {
        *to = from * sign;
    }
    (largest, others)
}

/// Undoes [`smallest_three`].
pub(crate) fn from_smallest_three(largest: usize, others: [f32; 3]) -> [f32; 4] {
    let rest = 1.0 - others.iter().map(|v| v * v).sum::<f32>();
    let mut rotation = [0.0; 4];
    let mut next = others.iter();
    for (i, to) in rotation.iter_mut().enumerate() {
        *to = if i == largest { rest.max(0.0).sqrt() } else { next.next().copied().unwrap_or(0.0) };
    }
    rotation
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_logits_agree() {
        for byte in 0..=255u8 {
            assert_eq!(unorm8(sigmoid(logit_of_byte(byte))), byte);
            assert_eq!(color_byte(dc_of_color(f32::from(byte) / 255.0)), byte);
        }
        assert_eq!(unorm8(f32::NAN), 0);
        assert_eq!((unorm(7.0, 10), unorm(-1.0, 10), unorm(1.0, 11)), (1023, 0, 2047));
    }

    #[test]
    fn the_largest_component_is_found_again() {
        for q in [[0.1, -0.2, 0.3, -0.9], [-0.8, 0.1, 0.2, 0.1], [0.5, 0.5, -0.5, 0.5]] {
            let q = unit(q);
            let (largest, others) = smallest_three(q);
            let again = from_smallest_three(largest, others);
            let dot: f32 = q.iter().zip(again).map(|(a, b)| a * b).sum();
            assert!((dot.abs() - 1.0).abs() < 1e-6, "{q:?} {again:?}");
        }
        assert_eq!(unit([0.0; 4]), [1.0, 0.0, 0.0, 0.0]);
    }
}
