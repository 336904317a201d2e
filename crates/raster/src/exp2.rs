//! `2^x` as a polynomial: the one transcendental function of the tile kernels.

use fearless_simd::{Simd, prelude::*};

/// Coefficients of `2^-y` on [0, 1] by degree, value 1 at 0 (Remez exchange on the relative
/// error). The eighth power is taken afterwards, which multiplies the relative error by eight:
/// 1.8e-2, 7.2e-4, 2.4e-5 and 6.7e-7 for degrees 2 to 5.
const COEFFICIENTS: [&[f32]; 4] = [
    &[1.0, -0.672_424_2, 0.173_531_37],
    &[1.0, -0.691_587_45, 0.231_158_57, -0.039_615_848],
    &[1.0, -0.693_063_57, 0.239_456_74, -0.053_223_578, 0.006_831_895],
    &[1.0, -0.693_143_7, 0.240_180_14, -0.055_297_36, 0.009_205_798, -0.000_944_903_7],
];

/// `2^(-8 y)` for `y` in [0, 1], that is for results down to 1/256.
///
/// Needs no rounding and no integer arithmetic. Beyond 1 the error grows (degree 5: 1.4e-4 at
/// 1.25, a result of 1/1024); far beyond it is meaningless, so mask first.
#[inline(always)]
pub(crate) fn exp2_minus_8<S: Simd, const DEGREE: usize>(simd: S, y: S::f32s) -> S::f32s {
    let c = COEFFICIENTS[DEGREE - 2];
    let mut r = S::f32s::simd_from(simd, c[DEGREE]);
    for k in (0..DEGREE).rev() {
        r = r.mul_add(y, c[k]);
    }
    let r2 = r * r;
    let r4 = r2 * r2;
    r4 * r4
}

/// The same for one value.
pub(crate) fn exp2_minus_8_scalar(degree: usize, y: f32) -> f32 {
    let [value] = exp2_minus_8_lanes(degree, &[y]);
    value
}

/// The same for one value per lane, without fused multiply-add.
#[inline(always)]
pub(crate) fn exp2_minus_8_lanes<const LANES: usize>(
    degree: usize,
    y: &[f32; LANES],
) -> [f32; LANES] {
    let mut r = [0.0f32; LANES];
    for &c in COEFFICIENTS[degree - 2].iter().rev() {
        for k in 0..LANES {
            r[k] = r[k] * y[k] + c;
        }
    }
    r.map(|r| {
        let r2 = r * r;
        let r4 = r2 * r2;
        r4 * r4
    })
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[inline(always)]
    fn lane0<S: Simd, const DEGREE: usize>(simd: S, y: f32) -> f32 {
        exp2_minus_8::<S, DEGREE>(simd, S::f32s::simd_from(simd, y)).as_slice()[0]
    }

    fn worst(degree: usize) -> f64 {
        let mut worst = 0.0f64;
        for i in 0..=40_000 {
            let y = i as f32 / 40_000.0;
            let got = dispatch!(Level::new(), simd => match degree {
                2 => lane0::<_, 2>(simd, y),
                3 => lane0::<_, 3>(simd, y),
                4 => lane0::<_, 4>(simd, y),
                _ => lane0::<_, 5>(simd, y),
            });
            let scalar = exp2_minus_8_scalar(degree, y);
            assert!((got / scalar - 1.0).abs() < 3e-6, "{degree} {y}: {got} {scalar}");
            worst = worst.max((f64::from(got) * (8.0 * f64::from(y)).exp2() - 1.0).abs());
        }
        worst
    }

    #[test]
    fn every_degree_keeps_its_error() {
        for (degree, bound) in [(2, 1.9e-2), (3, 7.5e-4), (4, 2.6e-5), (5, 2e-6)] {
            let worst = worst(degree);
            assert!(worst < bound && worst > bound / 20.0, "degree {degree}: {worst:e}");
        }
    }
}
