//! `λ mean (d_j - mean d)²`, `d_j = θ_j - u_j` with `u_j` a clear sky, per light and channel: `log φ(Z)` at the zenith angle `Z`, `φ(Z) = 1 -
//! exp(-0.32 / cos Z)` (CIE standard clear sky, ISO 15469, without the glow around the sun), so that the horizon is 3.6 times as bright as the
//! zenith. Ground, which reflects a fifth of what sun and sky give, is about as bright as the zenith.

use super::even_light::add_differences;
use super::prior::{CellSum, LightPrior, Lighting};
use crate::steps::light::cost::SolveOptions;

/// `b` of the gradation of a clear sky.
const GRADATION: f32 = 0.32;

pub(super) struct ClearSky;

impl LightPrior for ClearSky {
    fn name(&self) -> &'static str {
        "clear-sky"
    }

    fn about(&self) -> &'static str {
        "the sky is clear, brightest at the horizon"
    }

    fn usual_weight(&self, options: &SolveOptions) -> f32 {
        options.clear_sky
    }

    fn add_cells(&self, light: &Lighting<'_>, weight: f32, sum: &mut CellSum) {
        let usual = |j: usize| log_radiance(light.sources.heights[j]);
        add_differences(light, usual, weight, sum);
    }
}

/// Of a clear sky and the ground below it, at a sine of the elevation.
fn log_radiance(height: f32) -> f32 {
    let above = if height > 0.0 { height.max(1e-3) } else { 1.0 };
    (1.0 - (-GRADATION / above).exp()).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_horizon_is_brightest_and_the_ground_as_bright_as_the_zenith() {
        let [zenith, middle, horizon, ground] = [1.0, 0.5, 1e-4, -0.5].map(log_radiance);
        assert!((zenith - ground).abs() < 1e-6 && zenith < middle && middle < horizon);
        assert!(((horizon - zenith).exp() - 3.65).abs() < 0.02, "{}", (horizon - zenith).exp());
    }
}
