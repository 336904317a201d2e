//! `λ mean ρ(θ_j - e_j)`, `e` what is expected where photos show a part of the sky: the rest of the sky goes on as what they show, and
//! what lies below the horizon is as bright as the ground.
//!
//! Of a clipped sky only its shape is expected: above the horizon the cost is `λ mean ρ(θ_j - e_j - m)`, `m` the mean of `θ - e` there,
//! 0 at least.

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
        let cells = light.sources.expected.len() * light.lights;
        let share = weight / cells.max(1) as f32;
        for l in 0..light.lights {
            (0..3).for_each(|c| add_channel(light, l * light.per_light() + c, c, share, sum));
        }
    }
}

/// Adds channel `c` of a light, whose value of the first cell is `first`.
fn add_channel(light: &Lighting<'_>, first: usize, c: usize, share: f32, sum: &mut CellSum) {
    let at = |j: usize| first + 3 * j;
    let expected = light.sources.expected.iter().enumerate();
    let off = expected.filter_map(|(j, e)| Some((j, light.theta[at(j)] - (*e)?[c])));
    let (sky, ground): (Vec<_>, Vec<_>) = off.partition(|(j, _)| light.sources.heights[*j] > 0.0);
    let count = sky.len().max(1) as f32;
    let mean = sky.iter().map(|(_, off)| off).sum::<f32>() / count;
    let brighter = if light.sources.sky_is_clipped { mean.max(0.0) } else { 0.0 };
    let mut add = |cells: &[(usize, f32)], shift: f32| -> f32 {
        let slopes = cells.iter().map(|&(j, off)| {
            let (value, by) = rho(off - shift, EDGE);
            sum.cost += f64::from(share * value);
            sum.gradient[at(j)] += share * by;
            share * by / count
        });
        slopes.sum()
    };
    add(&ground, 0.0);
    let mean_slope = add(&sky, brighter);
    if brighter > 0.0 {
        // The mean moves with every cell of the sky.
        sky.iter().for_each(|(j, _)| sum.gradient[at(*j)] -= mean_slope);
    }
}
