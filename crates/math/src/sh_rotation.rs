//! Rotation of real spherical harmonics.
//!
//! A function on the sphere that turns with its object, `f'(d) = f(Rᵀ d)`, has in every band `l` the coefficients
//! `c' = M_l c` with
//!
//! ```text
//! M_l[a][b] = ∫ Y_a(d) Y_b(Rᵀ d) dd
//! ```
//!
//! The integrand is a polynomial of degree `2 l ≤ 8`, which the product of Gauss–Legendre in z and equal steps in azimuth
//! integrates without error, so the blocks are exact to rounding at any rotation. The convention of
//! [`crate::sh`] enters through its basis alone.

use crate::sh::{MAX_SH_DEGREE, sh_basis_f64};

/// Gauss–Legendre nodes above the equator and weights, 8 points: exact to degree 15.
const NODES: [(f64, f64); 4] = [
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
];
/// Azimuths: exact to degree 15.
const AZIMUTHS: usize = 16;

/// Turns coefficients of degree 0 to 4 by one rotation.
#[derive(Clone, Debug, PartialEq)]
pub struct ShRotation {
    /// Blocks of the bands 1 to 4, row-major, `(2 l + 1)^2` values each.
    bands: [Vec<f32>; 4],
}

impl ShRotation {
    /// The rotation that maps directions `d` of the old function to `R d`; `world_from_old` holds the rows
    /// of `R`, orthonormal with determinant 1.
    pub fn new(world_from_old: [[f64; 3]; 3]) -> Self {
        let mut bands = [1, 2, 3, 4].map(|l: usize| vec![0.0; (2 * l + 1).pow(2)]);
        for (z, weight) in NODES.iter().flat_map(|&(z, w)| [(z, w), (-z, w)]) {
            let radius = (1.0 - z * z).sqrt();
            for step in 0..AZIMUTHS {
                let phi = std::f64::consts::TAU * (step as f64 + 0.5) / AZIMUTHS as f64;
                let d = [radius * phi.cos(), radius * phi.sin(), z];
                // Rᵀ d: columns of R against d.
                let old = [0, 1, 2].map(|c| (0..3).map(|r| world_from_old[r][c] * d[r]).sum());
                let (mut new_basis, mut old_basis) = ([0.0; 25], [0.0; 25]);
                sh_basis_f64(MAX_SH_DEGREE, d, &mut new_basis);
                sh_basis_f64(MAX_SH_DEGREE, old, &mut old_basis);
                let weight = weight * std::f64::consts::TAU / AZIMUTHS as f64;
                for (band, l) in bands.iter_mut().zip(1usize..) {
                    let (first, size) = (l * l, 2 * l + 1);
                    for a in 0..size {
                        for b in 0..size {
                            band[a * size + b] +=
                                weight * new_basis[first + a] * old_basis[first + b];
                        }
                    }
                }
            }
        }
        Self { bands: bands.map(|band: Vec<f64>| band.into_iter().map(|v| v as f32).collect()) }
    }

    /// Turns the coefficients of one Gaussian, `[(degree + 1)^2, 3]`, in place.
    ///
    /// # Panics
    /// When `sh` has more than the 25 coefficients of degree 4.
    pub fn apply(&self, sh: &mut [f32]) {
        assert!(sh.len() <= 75, "degree at most 4: {} values", sh.len());
        for (band, l) in self.bands.iter().zip(1usize..) {
            let (first, size) = (3 * l * l, 2 * l + 1);
            let Some(values) = sh.get_mut(first..first + 3 * size) else { return };
            match l {
                1 => turn_band::<3>(band, values),
                2 => turn_band::<5>(band, values),
                3 => turn_band::<7>(band, values),
                _ => turn_band::<9>(band, values),
            }
        }
    }
}

/// The product of a block, row-major, and `values`, `[SIZE, 3]`, in place of `values`.
fn turn_band<const SIZE: usize>(band: &[f32], values: &mut [f32]) {
    // A fourth channel of nothing: four numbers at a time are one instruction.
    let mut old = [[0.0; 4]; SIZE];
    for (old, rgb) in old.iter_mut().zip(values.chunks_exact(3)) {
        old[..3].copy_from_slice(rgb);
    }
    for (new, row) in values.chunks_exact_mut(3).zip(band.chunks_exact(SIZE)) {
        let mut sum = [0.0; 4];
        for (m, rgb) in row.iter().zip(&old) {
            sum = [0, 1, 2, 3].map(|c| sum[c] + m * rgb[c]);
        }
        new.copy_from_slice(&sum[..3]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::{sh_basis, sh_coefficients};

    /// Rodrigues' formula about a unit axis.
    fn rotation(axis: [f64; 3], angle: f64) -> [[f64; 3]; 3] {
        let [x, y, z] = axis;
        let (s, c) = angle.sin_cos();
        let t = 1.0 - c;
        [
            [t * x * x + c, t * x * y - s * z, t * x * z + s * y],
            [t * x * y + s * z, t * y * y + c, t * y * z - s * x],
            [t * x * z - s * y, t * y * z + s * x, t * z * z + c],
        ]
    }

    fn value(degree: u8, sh: &[f32], d: [f64; 3]) -> [f32; 3] {
        let mut basis = [0.0; 25];
        sh_basis(degree, d.map(|v| v as f32), &mut basis);
        [0, 1, 2].map(|c| (0..sh_coefficients(degree)).map(|k| basis[k] * sh[3 * k + c]).sum())
    }

    #[test]
    fn the_function_turns_with_its_object() {
        let r = rotation([0.6, 0.0, 0.8], 1.1);
        let turn = ShRotation::new(r);
        for degree in 0..=4 {
            let old: Vec<f32> =
                (0..3 * sh_coefficients(degree)).map(|i| (i as f32 * 0.7).sin()).collect();
            let mut new = old.clone();
            turn.apply(&mut new);
            for d in [[1.0, 0.0, 0.0], [0.48, -0.6, 0.64], [0.0, 0.28, -0.96]] {
                let turned = [0, 1, 2].map(|i| (0..3).map(|k| r[i][k] * d[k]).sum());
                let (was, is) = (value(degree, &old, d), value(degree, &new, turned));
                for (a, b) in was.iter().zip(is) {
                    assert!((a - b).abs() < 2e-5, "degree {degree}: {was:?} {is:?}");
                }
            }
        }
    }

    #[test]
    fn back_and_forth_changes_nothing() {
        let axis = [0.36, 0.48, 0.8];
        let (there, back) = (rotation(axis, 2.5), rotation(axis, -2.5));
        let old: Vec<f32> = (0..75).map(|i| (i as f32 * 1.3).cos()).collect();
        let mut new = old.clone();
        ShRotation::new(there).apply(&mut new);
        let moved = new.iter().zip(&old).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(moved > 0.5, "{moved}");
        ShRotation::new(back).apply(&mut new);
        for (a, b) in new.iter().zip(&old) {
            assert!((a - b).abs() < 2e-6, "{a} {b}");
        }
    }
}
