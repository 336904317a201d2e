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
        let (per_light, cells) = (light.per_light(), &light.sources.expected);
        let share = weight / (cells.len() * light.lights).max(1) as f32;
        for l in 0..light.lights {
            for c in 0..3 {
                let index = |j: usize| l * per_light + 3 * j + c;
                let known = cells.iter().enumerate().filter_map(|(j, e)| Some((j, (*e)?[c])));
                let off: Vec<(usize, f32)> =
                    known.map(|(j, e)| (j, light.theta[index(j)] - e)).collect();
                let is_sky = |j: usize| light.sources.heights[j] > 0.0;
                let above = || off.iter().filter(|(j, _)| is_sky(*j));
                let count = above().count().max(1) as f32;
                let brighter = if light.sources.sky_is_clipped {
                    (above().map(|(_, off)| off).sum::<f32>() / count).max(0.0)
                } else {
                    0.0
                };
                let mut by_mean = 0.0;
                for &(j, off) in &off {
                    let shift = if is_sky(j) { brighter } else { 0.0 };
                    let (value, by) = rho(off - shift, EDGE);
                    sum.cost += f64::from(share * value);
                    sum.gradient[index(j)] += share * by;
                    by_mean += if is_sky(j) { share * by / count } else { 0.0 };
                }
                if brighter > 0.0 {
                    above().for_each(|(j, _)| sum.gradient[index(*j)] -= by_mean);
                }
            }
        }
    }
}
