//! `λ mean (d_j - mean d)²`, `d_j = θ_j - log(5) (1 + h_j) / 2` with `h` the sine of the elevation, per light and channel: the zenith is five
//! times as bright as the nadir. Skies, ceilings and lamps are above (Dror et al. 2004 see it in photographed maps), and light from where the cameras
//! stand casts no shadow that they see, so shading alone hardly tells the two apart.

use super::even_light::add_differences;
use super::prior::{CellSum, LightPrior, Lighting};
use crate::steps::light::cost::SolveOptions;

/// Radiance of the zenith over that of the nadir.
const ABOVE_OVER_BELOW: f32 = 5.0;

pub(super) struct LightFromAbove;

impl LightPrior for LightFromAbove {
    fn name(&self) -> &'static str {
        "light-from-above"
    }

    fn about(&self) -> &'static str {
        "light comes from above"
    }

    fn usual_weight(&self, options: &SolveOptions) -> f32 {
        options.above
    }

    fn add_cells(&self, light: &Lighting<'_>, weight: f32, sum: &mut CellSum) {
        let usual = |j: usize| ABOVE_OVER_BELOW.ln() * 0.5 * (1.0 + light.sources.heights[j]);
        add_differences(light, usual, weight, sum);
    }
}
