//! Logarithms per Gaussian that reach far, as colors that a rasterizer blends.
//!
//! [`Residual`] holds factors of up to 4; the ratio of two lights, and a lamp beside a wall, are more. They are drawn at a third.

use glam::Vec3;
use motes_math::sh::SH_C0;
use motes_scene::{Gaussians, Residual};

/// What is drawn of a logarithm.
const SHARE: f32 = 1.0 / 3.0;

/// The Gaussians with colors that stand for their logarithms.
pub(crate) fn drawn(log_factors: &[Vec3], gaussians: &Gaussians) -> Gaussians {
    // Harmonics of degree 0: a value over their constant.
    let unit = SHARE / SH_C0 as f32;
    let log_ratio_sh = log_factors.iter().flat_map(|l| (*l * unit).to_array()).collect();
    Residual { degree: 0, log_ratio_sh }.drawn(gaussians)
}

/// The logarithm of a pixel, from the color that was drawn over black there, and its alpha: the mean over what covers it.
pub(crate) fn read(drawn: Vec3, alpha: f32) -> Vec3 {
    drawn.map(|v| Residual::log_ratio(v, alpha) / (SHARE * alpha.max(1.0 / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_of_forty_comes_back() {
        let gaussians = motes_testkit::random_gaussians(2, 4, 1);
        let logs = [Vec3::new(3.7, -3.7, 0.0), Vec3::new(-1.0, 0.5, 2.0)];
        let drawn = drawn(&logs, &gaussians);
        for (i, log) in logs.iter().enumerate() {
            let color = Vec3::from_slice(&drawn.sh[3 * i..3 * i + 3]) * SH_C0 as f32 + 0.5;
            for alpha in [1.0, 0.4] {
                let back = read(color * alpha, alpha);
                assert!((back - *log).length() < 1e-4, "{back} {log}");
            }
        }
        assert!(read(Vec3::splat(f32::NAN), 1.0).is_finite());
    }
}
