//! Colors of a Gaussian under other light, from its colors and the ratio of the light.

use std::f32::consts::TAU;

use glam::Vec3;
use motes_math::sh::{SH_C0, sh_basis, sh_coefficients};
use motes_math::srgb;

/// Directions that a Gaussian's colors are looked at from.
pub(super) const DIRECTIONS: usize = 64;

/// Least-squares projection of values at [`DIRECTIONS`] viewers, spread evenly over the sphere, on
/// spherical harmonics.
pub(super) struct Projection {
    degree: u8,
    /// Unit vectors toward the viewers.
    pub(super) to_viewer: Vec<Vec3>,
    /// `[DIRECTIONS, K]`
    basis: Vec<[f32; 25]>,
    /// `[K, DIRECTIONS]`, row by row.
    inverse: Vec<Vec<f32>>,
}

impl Projection {
    pub(super) fn new(degree: u8) -> Self {
        const GOLDEN: f32 = 0.618_034;
        let to_viewer: Vec<Vec3> = (0..DIRECTIONS)
            .map(|d| {
                let z = 1.0 - 2.0 * (d as f32 + 0.5) / DIRECTIONS as f32;
                let r = (1.0 - z * z).max(0.0).sqrt();
                let (sin, cos) = (TAU * (d as f32 * GOLDEN).fract()).sin_cos();
                Vec3::new(r * cos, r * sin, z)
            })
            .collect();
        let basis: Vec<[f32; 25]> = to_viewer
            .iter()
            .map(|v| {
                let mut basis = [0.0; 25];
                // Harmonics are functions of the direction of sight, from the camera on.
                sh_basis(degree, (-*v).to_array(), &mut basis);
                basis
            })
            .collect();
        let k = sh_coefficients(degree);
        let mut inverse: Vec<Vec<f32>> = (0..k)
            .map(|j| basis.iter().map(|b| b[j] * 2.0 * TAU / DIRECTIONS as f32).collect())
            .collect();
        // Even points integrate products of harmonics nearly exactly; refinement makes B⁺ B the identity
        // (Ben-Israel and Cohen 1966: X <- X (2 - B X)).
        for _ in 0..4 {
            let dot = |row: &[f32], j: usize| -> f32 {
                row.iter().zip(&basis).map(|(x, b)| x * b[j]).sum()
            };
            let gram: Vec<Vec<f32>> =
                inverse.iter().map(|row| (0..k).map(|j| dot(row, j)).collect()).collect();
            inverse = (0..k)
                .map(|i| {
                    (0..DIRECTIONS)
                        .map(|d| {
                            let product: f32 = (0..k).map(|j| gram[i][j] * inverse[j][d]).sum();
                            2.0 * inverse[i][d] - product
                        })
                        .collect()
                })
                .collect();
        }
        Self { degree, to_viewer, basis, inverse }
    }

    fn shown(&self, sh: &[f32], d: usize) -> Vec3 {
        let mut color = Vec3::splat(0.5);
        for (y, c) in self.basis[d].iter().zip(sh.chunks_exact(3)) {
            color += *y * Vec3::new(c[0], c[1], c[2]);
        }
        color
    }

    /// Multiplies the linear color toward each viewer by `ratio(d)`.
    pub(super) fn scale(&self, sh: &mut [f32], ratio: impl Fn(usize) -> Vec3) {
        let k = sh_coefficients(self.degree);
        let mut change = [[0.0f32; 3]; 25];
        for d in 0..DIRECTIONS {
            let shown = self.shown(sh, d).clamp(Vec3::ZERO, Vec3::ONE);
            let ratio = ratio(d);
            let scaled = Vec3::from_array(std::array::from_fn(|c| {
                srgb::encode((srgb::decode(shown[c]) * ratio[c]).clamp(0.0, 1.0))
            }));
            let step = scaled - shown;
            for (change, inverse) in change.iter_mut().zip(&self.inverse) {
                let x = inverse[d];
                change[0] += x * step.x;
                change[1] += x * step.y;
                change[2] += x * step.z;
            }
        }
        for (out, change) in sh.chunks_exact_mut(3).zip(&change[..k]) {
            out.iter_mut().zip(change).for_each(|(o, c)| *o += c);
        }
    }

    /// The same linear color toward every viewer.
    pub(super) fn set_even(&self, sh: &mut [f32], color_linear: Vec3) {
        sh.fill(0.0);
        self.set_dc(&mut sh[..3], color_linear);
    }

    /// The mean over all viewers.
    pub(super) fn set_dc(&self, dc: &mut [f32], color_linear: Vec3) {
        for (out, v) in dc.iter_mut().zip(color_linear.to_array()) {
            *out = (srgb::encode(v.clamp(0.0, 1.0)) - 0.5) / SH_C0 as f32;
        }
    }

    /// Linear color toward a viewer.
    pub(super) fn radiance(&self, sh: &[f32], to_viewer: Vec3) -> Vec3 {
        let mut basis = [0.0; 25];
        sh_basis(self.degree, (-to_viewer).to_array(), &mut basis);
        let mut color = Vec3::splat(0.5);
        for (y, c) in basis.iter().zip(sh.chunks_exact(3)) {
            color += *y * Vec3::new(c[0], c[1], c[2]);
        }
        Vec3::from_array(color.to_array().map(|v| srgb::decode(v.clamp(0.0, 1.0))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_scales_what_viewers_see() {
        for degree in 0..=3 {
            let projection = Projection::new(degree);
            let k = sh_coefficients(degree);
            let mut sh: Vec<f32> =
                (0..3 * k).map(|i| 0.05 * ((i * 7 % 11) as f32 - 5.0) / (1.0 + i as f32)).collect();
            let old = sh.clone();
            projection.scale(&mut sh, |_| Vec3::ONE);
            let off = sh.iter().zip(&old).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < 1e-6, "nothing to change: {off}");
            let ratio = Vec3::new(0.5, 1.2, 0.1);
            projection.scale(&mut sh, |_| ratio);
            for d in 0..DIRECTIONS {
                let v = projection.to_viewer[d];
                let (is, was) = (projection.radiance(&sh, v), projection.radiance(&old, v));
                let error = (is - was * ratio).abs().max_element();
                assert!(error < 0.01, "degree {degree}: {is} for {}", was * ratio);
            }
        }
    }

    #[test]
    fn extremes_stay_finite() {
        let projection = Projection::new(3);
        for value in [0.0, 1e30, -1e30] {
            let mut sh = vec![value; 48];
            projection.scale(&mut sh, |_| Vec3::splat(20.0));
            assert!(sh.iter().all(|v| v.is_finite()), "{value}");
        }
    }
}
