//! `λ mean (d_j - mean d)²`, `d_j = θ_j - log(5) (1 + h_j) / 2` with `h` the sine of the elevation, per light and channel: the zenith is five
//! times as bright as the nadir. Skies, ceilings and lamps are above (Dror et al. 2004 see it in photographed maps), and light from where the cameras
//! stand casts no shadow that they see, so shading alone hardly tells the two apart.

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
        let (per_light, heights) = (light.per_light(), &light.sources.heights);
        let share = weight / (3 * heights.len() * light.lights).max(1) as f32;
        let usual = |h: &f32| ABOVE_OVER_BELOW.ln() * 0.5 * (1.0 + h);
        for l in 0..light.lights {
            for c in 0..3 {
                let at = |j: usize| l * per_light + 3 * j + c;
                let off = |(j, h): (usize, &f32)| light.theta[at(j)] - usual(h);
                let mean =
                    heights.iter().enumerate().map(off).sum::<f32>() / heights.len().max(1) as f32;
                for (j, h) in heights.iter().enumerate() {
                    // The slope of the mean cancels: deviations sum to 0.
                    let d = off((j, h)) - mean;
                    sum.cost += f64::from(share * d * d);
                    sum.gradient[at(j)] += 2.0 * share * d;
                }
            }
        }
    }
}
