//! `λ mean ρ(θ_j - e_j)`, `e` what is expected where photos show a part of the sky: the rest of the sky goes on as what they show, and
//! what lies below the horizon is as bright as the ground.

use super::prior::{CellSum, LightPrior, Lighting};
use crate::steps::light::cost::{SolveOptions, rho};

/// Differences of log radiance beyond are a sun.
const EDGE: f32 = 0.3;

pub(super) struct ExpectedSky;

impl LightPrior for ExpectedSky {
    fn name(&self) -> &'static str {
        "expected-sky"
    }

    fn about(&self) -> &'static str {
        "the sky goes on as the part of it that photos show"
    }

    fn usual_weight(&self, _options: &SolveOptions) -> f32 {
        1.0
    }

    fn add_cells(&self, light: &Lighting<'_>, weight: f32, sum: &mut CellSum) {
        let (per_light, cells) = (light.per_light(), &light.sources.expected);
        let share = weight / (cells.len() * light.lights).max(1) as f32;
        for l in 0..light.lights {
            for (j, expected) in cells.iter().enumerate() {
                let Some(expected) = expected else { continue };
                for c in 0..3 {
                    let k = l * per_light + 3 * j + c;
                    let (value, by) = rho(light.theta[k] - expected[c], EDGE);
                    sum.cost += f64::from(share * value);
                    sum.gradient[k] += share * by;
                }
            }
        }
    }
}
