//! Real spherical harmonics as 3D Gaussian splatting stores them.
//!
//! Basis `Y_k(d)`, `k = l^2 + l + m`, with the Condon–Shortley phase, so band 1 is
//! `(-c y, c z, -c x)`. Color = 0.5 + Σ_k Y_k(d) coefficient_k, with `d` the unit vector from the
//! camera center to the Gaussian. Source: Sloan, "Efficient Spherical Harmonic Evaluation" (2013),
//! written out as polynomials.

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

macro_rules! sh_for {
    ($t:ty, $basis:ident, $gradient:ident) => {
        /// Writes the basis `Y_k(direction)` into the first `(degree + 1)^2` places.
        ///
        /// `direction` is a unit vector; `degree` is at most 4.
        #[inline(always)]
        pub fn $basis(degree: u8, direction: [$t; 3], out: &mut [$t; 25]) {
            let [x, y, z] = direction;
            out[0] = SH_C0 as $t;
            if degree >= 1 {
                let c = C1 as $t;
                out[1] = -c * y;
                out[2] = c * z;
                out[3] = -c * x;
            }
            if degree < 2 {
                return;
            }
            let (xx, yy, zz) = (x * x, y * y, z * z);
            let c = C2.map(|c| c as $t);
            out[4] = c[0] * x * y;
            out[5] = -c[0] * y * z;
            out[6] = c[1] * (2.0 * zz - xx - yy);
            out[7] = -c[0] * x * z;
            out[8] = c[2] * (xx - yy);
            if degree < 3 {
                return;
            }
            let c = C3.map(|c| c as $t);
            out[9] = -c[0] * y * (3.0 * xx - yy);
            out[10] = c[1] * x * y * z;
            out[11] = -c[2] * y * (4.0 * zz - xx - yy);
            out[12] = c[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
            out[13] = -c[2] * x * (4.0 * zz - xx - yy);
            out[14] = 0.5 * c[1] * z * (xx - yy);
            out[15] = -c[0] * x * (xx - 3.0 * yy);
            if degree < 4 {
                return;
            }
            let c = C4.map(|c| c as $t);
            out[16] = c[0] * x * y * (xx - yy);
            out[17] = -c[1] * y * z * (3.0 * xx - yy);
            out[18] = c[2] * x * y * (7.0 * zz - 1.0);
            out[19] = -c[3] * y * z * (7.0 * zz - 3.0);
            out[20] = c[4] * (zz * (35.0 * zz - 30.0) + 3.0);
            out[21] = -c[3] * x * z * (7.0 * zz - 3.0);
            out[22] = 0.5 * c[2] * (xx - yy) * (7.0 * zz - 1.0);
            out[23] = -c[1] * x * z * (xx - 3.0 * yy);
            out[24] = 0.25 * c[0] * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy));
        }

        /// Writes `∂Y_k/∂(x, y, z)` of the polynomials in [`
        #[doc = stringify!($basis)]
        /// `] (not projected on the sphere) into the first `(degree + 1)^2` places.
        #[inline(always)]
        pub fn $gradient(degree: u8, direction: [$t; 3], out: &mut [[$t; 3]; 25]) {
            let [x, y, z] = direction;
            out[0] = [0.0; 3];
            if degree >= 1 {
                let c = C1 as $t;
                out[1] = [0.0, -c, 0.0];
                out[2] = [0.0, 0.0, c];
                out[3] = [-c, 0.0, 0.0];
            }
            if degree < 2 {
                return;
            }
            let (xx, yy, zz) = (x * x, y * y, z * z);
            let c = C2.map(|c| c as $t);
            out[4] = [c[0] * y, c[0] * x, 0.0];
            out[5] = [0.0, -c[0] * z, -c[0] * y];
            out[6] = [-2.0 * c[1] * x, -2.0 * c[1] * y, 4.0 * c[1] * z];
            out[7] = [-c[0] * z, 0.0, -c[0] * x];
            out[8] = [2.0 * c[2] * x, -2.0 * c[2] * y, 0.0];
            if degree < 3 {
                return;
            }
            let c = C3.map(|c| c as $t);
            out[9] = [-6.0 * c[0] * x * y, -3.0 * c[0] * (xx - yy), 0.0];
            out[10] = [c[1] * y * z, c[1] * x * z, c[1] * x * y];
            out[11] = [2.0 * c[2] * x * y, -c[2] * (4.0 * zz - xx - 3.0 * yy), -8.0 * c[2] * y * z];
            out[12] = [-6.0 * c[3] * x * z, -6.0 * c[3] * y * z, 3.0 * c[3] * (2.0 * zz - xx - yy)];
            out[13] = [-c[2] * (4.0 * zz - 3.0 * xx - yy), 2.0 * c[2] * x * y, -8.0 * c[2] * x * z];
            out[14] = [c[1] * x * z, -c[1] * y * z, 0.5 * c[1] * (xx - yy)];
            out[15] = [-3.0 * c[0] * (xx - yy), 6.0 * c[0] * x * y, 0.0];
            if degree < 4 {
                return;
            }
            let c = C4.map(|c| c as $t);
            out[16] = [c[0] * y * (3.0 * xx - yy), c[0] * x * (xx - 3.0 * yy), 0.0];
            out[17] =
                [-6.0 * c[1] * x * y * z, -3.0 * c[1] * z * (xx - yy), -c[1] * y * (3.0 * xx - yy)];
            out[18] =
                [c[2] * y * (7.0 * zz - 1.0), c[2] * x * (7.0 * zz - 1.0), 14.0 * c[2] * x * y * z];
            out[19] = [0.0, -c[3] * z * (7.0 * zz - 3.0), -c[3] * y * (21.0 * zz - 3.0)];
            out[20] = [0.0, 0.0, c[4] * z * (140.0 * zz - 60.0)];
            out[21] = [-c[3] * z * (7.0 * zz - 3.0), 0.0, -c[3] * x * (21.0 * zz - 3.0)];
            out[22] = [
                c[2] * x * (7.0 * zz - 1.0),
                -c[2] * y * (7.0 * zz - 1.0),
                7.0 * c[2] * z * (xx - yy),
            ];
            out[23] =
                [-3.0 * c[1] * z * (xx - yy), 6.0 * c[1] * x * y * z, -c[1] * x * (xx - 3.0 * yy)];
            out[24] = [c[0] * x * (xx - 3.0 * yy), -c[0] * y * (3.0 * xx - yy), 0.0];
        }
    };
}

sh_for!(f32, sh_basis, sh_basis_gradient);
sh_for!(f64, sh_basis_f64, sh_basis_gradient_f64);

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
