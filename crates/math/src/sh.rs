//! Real spherical harmonics as 3D Gaussian splatting stores them.
//!
//! Basis `Y_k(d)`, `k = l^2 + l + m`, with the Condon–Shortley phase, so band 1 is
//! `(-c y, c z, -c x)`. Color = 0.5 + Σ_k Y_k(d) coefficient_k, with `d` the unit vector from the
//! camera center to the Gaussian. Source: Sloan, "Efficient Spherical Harmonic Evaluation" (2013),
//! written out as polynomials.

use std::ops::{Add, Mul, Neg, Sub};

/// `Y_0`: the constant of band 0.
pub const SH_C0: f64 = 0.282_094_791_773_878_14;
const C1: f64 = 0.488_602_511_902_919_9;
const C2: [f64; 3] = [1.092_548_430_592_079_2, 0.315_391_565_252_520_05, 0.546_274_215_296_039_6];
const C3: [f64; 4] = [
    0.590_043_589_926_643_5,
    2.890_611_442_640_554,
    0.457_045_799_464_465_8,
    0.373_176_332_590_115_4,
];
const C4: [f64; 5] = [
    2.503_342_941_796_704_6,
    1.770_130_769_779_930_4,
    0.946_174_695_757_560_1,
    0.669_046_543_557_289_1,
    0.105_785_546_915_204_32,
];

/// Highest supported degree.
pub const MAX_SH_DEGREE: u8 = 4;

/// Number of coefficients of degree `degree`: `(degree + 1)^2`.
pub const fn sh_coefficients(degree: u8) -> usize {
    (degree as usize + 1) * (degree as usize + 1)
}

/// A constant of the polynomials in the precision of `Self`.
pub trait ShConstant: Copy + Neg<Output = Self> + Mul<Output = Self> {
    /// The nearest number.
    fn of(value: f64) -> Self;
}

impl ShConstant for f32 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value as Self
    }
}

impl ShConstant for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }
}

/// What the polynomials are evaluated in: a number, or a vector with one direction per lane, with
/// constants `E`.
pub trait ShValue<E>:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Add<E, Output = Self>
    + Sub<E, Output = Self>
    + Mul<E, Output = Self>
{
}

impl<E, T> ShValue<E> for T where
    T: Copy
        + Neg<Output = T>
        + Add<Output = T>
        + Sub<Output = T>
        + Mul<Output = T>
        + Add<E, Output = T>
        + Sub<E, Output = T>
        + Mul<E, Output = T>
{
}

/// Writes the basis `Y_k(direction)` into the first `(degree + 1)^2` places.
///
/// `direction` is a unit vector, `one` is 1; `degree` is at most 4.
#[inline(always)]
pub fn sh_basis_of<E: ShConstant, T: ShValue<E>>(
    degree: u8,
    one: T,
    direction: [T; 3],
    out: &mut [T; 25],
) {
    let n = E::of;
    let [x, y, z] = direction;
    out[0] = one * n(SH_C0);
    if degree >= 1 {
        let c = n(C1);
        out[1] = y * -c;
        out[2] = z * c;
        out[3] = x * -c;
    }
    if degree < 2 {
        return;
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let c = C2.map(n);
    out[4] = x * c[0] * y;
    out[5] = y * -c[0] * z;
    out[6] = (zz * n(2.0) - xx - yy) * c[1];
    out[7] = x * -c[0] * z;
    out[8] = (xx - yy) * c[2];
    if degree < 3 {
        return;
    }
    let c = C3.map(n);
    out[9] = y * -c[0] * (xx * n(3.0) - yy);
    out[10] = x * c[1] * y * z;
    out[11] = y * -c[2] * (zz * n(4.0) - xx - yy);
    out[12] = z * c[3] * (zz * n(2.0) - xx * n(3.0) - yy * n(3.0));
    out[13] = x * -c[2] * (zz * n(4.0) - xx - yy);
    out[14] = z * (n(0.5) * c[1]) * (xx - yy);
    out[15] = x * -c[0] * (xx - yy * n(3.0));
    if degree < 4 {
        return;
    }
    let c = C4.map(n);
    let (zz7_1, zz7_3) = (zz * n(7.0) - n(1.0), zz * n(7.0) - n(3.0));
    out[16] = x * c[0] * y * (xx - yy);
    out[17] = y * -c[1] * z * (xx * n(3.0) - yy);
    out[18] = x * c[2] * y * zz7_1;
    out[19] = y * -c[3] * z * zz7_3;
    out[20] = (zz * (zz * n(35.0) - n(30.0)) + n(3.0)) * c[4];
    out[21] = x * -c[3] * z * zz7_3;
    out[22] = (xx - yy) * (n(0.5) * c[2]) * zz7_1;
    out[23] = x * -c[1] * z * (xx - yy * n(3.0));
    out[24] = (xx * (xx - yy * n(3.0)) - yy * (xx * n(3.0) - yy)) * (n(0.25) * c[0]);
}

/// Writes `∂Y_k/∂(x, y, z)` of the polynomials in [`sh_basis_of`] (not projected on the sphere)
/// into the first `(degree + 1)^2` places.
#[inline(always)]
pub fn sh_basis_gradient_of<E: ShConstant, T: ShValue<E>>(
    degree: u8,
    one: T,
    direction: [T; 3],
    out: &mut [[T; 3]; 25],
) {
    let n = E::of;
    let [x, y, z] = direction;
    let zero = one * n(0.0);
    out[0] = [zero; 3];
    if degree >= 1 {
        let c = n(C1);
        out[1] = [zero, one * -c, zero];
        out[2] = [zero, zero, one * c];
        out[3] = [one * -c, zero, zero];
    }
    if degree < 2 {
        return;
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let c = C2.map(n);
    out[4] = [y * c[0], x * c[0], zero];
    out[5] = [zero, z * -c[0], y * -c[0]];
    out[6] = [x * (n(-2.0) * c[1]), y * (n(-2.0) * c[1]), z * (n(4.0) * c[1])];
    out[7] = [z * -c[0], zero, x * -c[0]];
    out[8] = [x * (n(2.0) * c[2]), y * (n(-2.0) * c[2]), zero];
    if degree < 3 {
        return;
    }
    let c = C3.map(n);
    let c6 = c.map(|c| n(6.0) * c);
    let c3 = c.map(|c| n(3.0) * c);
    let (xy, c8) = (x * (n(2.0) * c[2]) * y, n(-8.0) * c[2]);
    out[9] = [x * -c6[0] * y, (xx - yy) * -c3[0], zero];
    out[10] = [y * c[1] * z, x * c[1] * z, x * c[1] * y];
    out[11] = [xy, (zz * n(4.0) - xx - yy * n(3.0)) * -c[2], y * c8 * z];
    out[12] = [x * -c6[3] * z, y * -c6[3] * z, (zz * n(2.0) - xx - yy) * c3[3]];
    out[13] = [(zz * n(4.0) - xx * n(3.0) - yy) * -c[2], xy, x * c8 * z];
    out[14] = [x * c[1] * z, y * -c[1] * z, (xx - yy) * (n(0.5) * c[1])];
    out[15] = [(xx - yy) * -c3[0], x * c6[0] * y, zero];
    if degree < 4 {
        return;
    }
    let c = C4.map(n);
    let (zz7_1, zz7_3) = (zz * n(7.0) - n(1.0), zz * n(7.0) - n(3.0));
    let (x3, y3) = (xx - yy * n(3.0), xx * n(3.0) - yy);
    let zz21 = zz * n(21.0) - n(3.0);
    let (c1_6, c1_3) = (n(6.0) * c[1], n(3.0) * c[1]);
    out[16] = [y * c[0] * y3, x * c[0] * x3, zero];
    out[17] = [x * -c1_6 * y * z, z * -c1_3 * (xx - yy), y * -c[1] * y3];
    out[18] = [y * c[2] * zz7_1, x * c[2] * zz7_1, x * (n(14.0) * c[2]) * y * z];
    out[19] = [zero, z * -c[3] * zz7_3, y * -c[3] * zz21];
    out[20] = [zero, zero, z * c[4] * (zz * n(140.0) - n(60.0))];
    out[21] = [z * -c[3] * zz7_3, zero, x * -c[3] * zz21];
    out[22] = [x * c[2] * zz7_1, y * -c[2] * zz7_1, z * (n(7.0) * c[2]) * (xx - yy)];
    out[23] = [z * -c1_3 * (xx - yy), x * c1_6 * y * z, x * -c[1] * x3];
    out[24] = [x * c[0] * x3, y * -c[0] * y3, zero];
}

/// [`sh_basis_of`] in single precision.
#[inline(always)]
pub fn sh_basis(degree: u8, direction: [f32; 3], out: &mut [f32; 25]) {
    sh_basis_of::<f32, f32>(degree, 1.0, direction, out);
}

/// [`sh_basis_of`] in double precision.
#[inline(always)]
pub fn sh_basis_f64(degree: u8, direction: [f64; 3], out: &mut [f64; 25]) {
    sh_basis_of::<f64, f64>(degree, 1.0, direction, out);
}

/// [`sh_basis_gradient_of`] in single precision.
#[inline(always)]
pub fn sh_basis_gradient(degree: u8, direction: [f32; 3], out: &mut [[f32; 3]; 25]) {
    sh_basis_gradient_of::<f32, f32>(degree, 1.0, direction, out);
}

/// [`sh_basis_gradient_of`] in double precision.
#[inline(always)]
pub fn sh_basis_gradient_f64(degree: u8, direction: [f64; 3], out: &mut [[f64; 3]; 25]) {
    sh_basis_gradient_of::<f64, f64>(degree, 1.0, direction, out);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points and weights that integrate polynomials of degree 15 over the sphere exactly:
    /// Gauss–Legendre in z times equal steps in azimuth.
    fn quadrature() -> Vec<([f64; 3], f64)> {
        const NODES: [(f64, f64); 4] = [
            (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
            (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
            (0.525_532_409_916_329, 0.313_706_645_877_887_3),
            (0.183_434_642_495_649_8, 0.362_683_783_378_362),
        ];
        let azimuths = 20;
        let mut points = Vec::new();
        for (z, w) in NODES.iter().flat_map(|&(z, w)| [(z, w), (-z, w)]) {
            for i in 0..azimuths {
                let phi = std::f64::consts::TAU * (i as f64 + 0.5) / azimuths as f64;
                let r = (1.0 - z * z).sqrt();
                points.push((
                    [r * phi.cos(), r * phi.sin(), z],
                    w * std::f64::consts::TAU / azimuths as f64,
                ));
            }
        }
        points
    }

    #[test]
    fn basis_is_orthonormal() {
        let mut gram = [[0.0; 25]; 25];
        for (direction, weight) in quadrature() {
            let mut y = [0.0; 25];
            sh_basis_f64(4, direction, &mut y);
            for i in 0..25 {
                for j in 0..25 {
                    gram[i][j] += weight * y[i] * y[j];
                }
            }
        }
        for (i, row) in gram.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let expected = f64::from(i == j);
                assert!((value - expected).abs() < 1e-12, "<Y{i}, Y{j}> = {value}");
            }
        }
    }

    #[test]
    fn gradients_match_finite_differences() {
        let d = [0.48, -0.6, 0.64];
        let mut gradient = [[0.0; 3]; 25];
        sh_basis_gradient_f64(4, d, &mut gradient);
        for axis in 0..3 {
            let h = 1e-6;
            let (mut plus, mut minus) = ([0.0; 25], [0.0; 25]);
            let mut shifted = d;
            shifted[axis] += h;
            sh_basis_f64(4, shifted, &mut plus);
            shifted[axis] -= 2.0 * h;
            sh_basis_f64(4, shifted, &mut minus);
            for k in 0..25 {
                let numeric = (plus[k] - minus[k]) / (2.0 * h);
                assert!((numeric - gradient[k][axis]).abs() < 1e-8, "k {k} axis {axis}");
            }
        }
    }

    #[test]
    fn single_precision_agrees() {
        let (mut y32, mut y64) = ([0f32; 25], [0f64; 25]);
        sh_basis(4, [0.48, -0.6, 0.64], &mut y32);
        sh_basis_f64(4, [0.48, -0.6, 0.64], &mut y64);
        for (a, b) in y32.iter().zip(y64) {
            assert!((f64::from(*a) - b).abs() < 1e-6);
        }
    }

    #[test]
    fn band_one_has_the_phase_of_the_file_format() {
        let mut y = [0.0; 25];
        sh_basis_f64(1, [1.0, 0.0, 0.0], &mut y);
        assert!(y[3] < 0.0 && y[1] == 0.0 && y[2] == 0.0);
    }
}
