//! `λ_white Σ_c (m_c - mean_c m)²`, `m = mean_p log S_p`: the light is nearly white on the whole, and, much less,
//! `λ_white / 100 mean (θ_c - mean_c θ)²`: from everywhere.

use glam::Vec3;

use super::prior::{CellSum, LightPrior, Lighting, PointSum, Slopes};
use crate::steps::light::cost::SolveOptions;

/// Weight of every cell against that of the whole.
const OF_CELLS: f32 = 0.01;

pub(super) struct WhiteLight;

impl LightPrior for WhiteLight {
    fn name(&self) -> &'static str {
        "white-light"
    }

    fn about(&self) -> &'static str {
        "the light is nearly white, on the whole"
    }

    fn flag(&self) -> Option<&'static str> {
        Some("--weight-white-light")
    }

    fn weight(&self, options: &SolveOptions) -> f32 {
        options.white
    }

    fn add_points(&self, light: &Lighting<'_>, weight: f32, sum: &mut PointSum) {
        let n = light.shading.len().max(1) as f32;
        let tint = light.shading.iter().map(|s| s.ln()).sum::<Vec3>() / n;
        let tint = tint - tint.element_sum() / 3.0;
        sum.cost += f64::from(weight * tint.length_squared());
        sum.by_log_shading.push(Slopes::Even(tint * (2.0 * weight / n)));
    }

    fn add_cells(&self, light: &Lighting<'_>, weight: f32, sum: &mut CellSum) {
        let (per_light, cells) = (light.per_light(), light.of_cells());
        let share = OF_CELLS * weight / (cells * light.lights / 3).max(1) as f32;
        let lights = light.theta.chunks(per_light).zip(sum.gradient.chunks_mut(per_light));
        let triples = lights.flat_map(|(theta, gradient)| {
            theta[..cells].chunks_exact(3).zip(gradient[..cells].chunks_exact_mut(3))
        });
        for (t, g) in triples {
            let mean = (t[0] + t[1] + t[2]) / 3.0;
            for c in 0..3 {
                let d = t[c] - mean;
                sum.cost += f64::from(share * d * d);
                g[c] += 2.0 * share * d;
            }
        }
    }
}
