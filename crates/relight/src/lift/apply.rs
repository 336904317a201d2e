//! A ratio of light on colors that are stored as harmonics of encoded values.
//!
//! With `f(c) = encode(ratio · decode(c))`: the mean color `c_0` becomes `f(c_0)`, the bands above it are scaled by
//! `f'(c_0)`.

use motes_math::sh::SH_C0;
use motes_scene::Gaussians;

use motes_math::srgb;

/// Step of the derivative, encoded.
const STEP: f32 = 1e-3;
/// Bounds of the factor on the bands: near black the curve is steep.
const BAND_FACTOR: [f32; 2] = [0.1, 4.0];

/// The Gaussians with colors times `exp(log_ratio)`, linear.
pub(super) fn apply(gaussians: &Gaussians, log_ratio: &[[f32; 3]]) -> Gaussians {
    let mut out = gaussians.clone();
    let stride = 3 * out.sh_coefficients();
    for (sh, log) in out.sh.chunks_exact_mut(stride).zip(log_ratio) {
        for c in 0..3 {
            if log[c] == 0.0 {
                continue;
            }
            let ratio = log[c].exp();
            let f = |v: f32| srgb::encode(ratio * srgb::decode(v));
            let mean = 0.5 + SH_C0 as f32 * sh[c];
            let slope = (f(mean + STEP) - f(mean - STEP)) / (2.0 * STEP);
            sh[c] = (f(mean) - 0.5) / SH_C0 as f32;
            for value in sh.iter_mut().skip(3 + c).step_by(3) {
                *value *= slope.clamp(BAND_FACTOR[0], BAND_FACTOR[1]);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_multiplies_linear_colors() {
        let mut sh = vec![0.0; 12];
        sh[0] = 0.4;
        sh[3] = 0.1;
        let gaussians = Gaussians {
            means: vec![[0.0; 3]],
            rotations: vec![[1.0, 0.0, 0.0, 0.0]],
            log_scales: vec![[0.0; 3]],
            opacity_logits: vec![0.0],
            sh_degree: 1,
            sh,
            extra: Vec::new(),
        };
        let out = apply(&gaussians, &[[0.5f32.ln(), 0.0, 2f32.ln()]]);
        let color = |g: &Gaussians, c: usize| srgb::decode(0.5 + SH_C0 as f32 * g.sh[c]);
        assert!((color(&out, 0) - 0.5 * color(&gaussians, 0)).abs() < 1e-5);
        assert_eq!(color(&out, 1), color(&gaussians, 1));
        assert!((color(&out, 2) - 2.0 * color(&gaussians, 2)).abs() < 1e-5);
        // A view that the first band makes brighter stays brighter by the same ratio, to first order.
        let tilted = |g: &Gaussians| srgb::decode(0.5 + SH_C0 as f32 * g.sh[0] + 0.1 * g.sh[3]);
        assert!((tilted(&out) / tilted(&gaussians) - 0.5).abs() < 2e-3);
    }
}
