//! A ratio of light on colors that are stored as harmonics of encoded values.
//!
//! With `f(c) = encode(ratio · decode(c))`: the mean color `c_0` becomes `f(c_0)`, the bands above it are scaled by
//! `f'(c_0)`.

use motes_math::srgb;
use motes_scene::Gaussians;

/// The Gaussians with colors times `exp(log_ratio)`, linear.
pub(super) fn apply(gaussians: &Gaussians, log_ratio: &[[f32; 3]]) -> Gaussians {
    gaussians.with_colors_mapped(|i, c, v| match log_ratio[i][c] {
        0.0 => v,
        log => srgb::encode(log.exp() * srgb::decode(v)),
    })
}

#[cfg(test)]
mod tests {
    use motes_math::sh::SH_C0;

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
