//! `λ_smooth mean ρ(θ_i - θ_j)` over touching cells: smooth light, edges allowed; and `λ_smooth λ_color mean (d - mean_c d)²`,
//! `d = θ_i - θ_j`: neighbors have one color. Each channel would otherwise fit noise of its own, and a lamp come out as a
//! rainbow.

use glam::Vec3;

use super::prior::{CellSum, LightPrior, Lighting};
use crate::steps::light::cost::{SolveOptions, rho};

/// Differences of log radiance beyond are edges.
const EDGE: f32 = 0.3;

pub(super) struct SmoothLight;

impl LightPrior for SmoothLight {
    fn name(&self) -> &'static str {
        "smooth-light"
    }

    fn about(&self) -> &'static str {
        "the light is smooth, but for few edges"
    }

    fn flag(&self) -> Option<&'static str> {
        Some("--weight-smooth-light")
    }

    fn weight(&self, options: &SolveOptions) -> f32 {
        options.smooth
    }

    fn add_cells(&self, light: &Lighting<'_>, weight: f32, sum: &mut CellSum) {
        let CellSum { cost, gradient } = sum;
        let (theta, lights, colored) = (light.theta, light.lights, light.options.color);
        let columns = theta.len() / (3 * lights.max(1));
        let share = weight / (light.sources.neighbors.len() * lights).max(1) as f32;
        let pairs_of_cells = (0..lights).flat_map(|l| {
            let of =
                move |&(i, j): &(u32, u32)| (i as usize + l * columns, j as usize + l * columns);
            light.sources.neighbors.iter().map(of)
        });
        for (i, j) in pairs_of_cells {
            for c in 0..3 {
                let (a, b) = (3 * i + c, 3 * j + c);
                let (value, by) = rho(theta[a] - theta[b], EDGE);
                *cost += f64::from(share * value);
                gradient[a] += share * by;
                gradient[b] -= share * by;
            }
            let difference = Vec3::from([0, 1, 2].map(|c| theta[3 * i + c] - theta[3 * j + c]));
            let tint = difference - difference.element_sum() / 3.0;
            *cost += f64::from(share * colored * tint.length_squared());
            for c in 0..3 {
                gradient[3 * i + c] += 2.0 * share * colored * tint[c];
                gradient[3 * j + c] -= 2.0 * share * colored * tint[c];
            }
        }
    }
}
