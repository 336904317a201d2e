//! `λ mean (θ_j - mean θ)²`, per light and channel: where the photos tell nothing, the light is the mean of the rest (ridge
//! regression on log radiance).

use super::prior::{CellSum, LightPrior, Lighting};

pub(super) struct EvenLight;

impl LightPrior for EvenLight {
    fn name(&self) -> &'static str {
        "even-light"
    }

    fn about(&self) -> &'static str {
        "the light is as bright from everywhere"
    }

    fn add_cells(&self, light: &Lighting<'_>, weight: f32, sum: &mut CellSum) {
        add_differences(light, |_| 0.0, weight, sum);
    }
}

/// Adds `λ mean (d_j - mean d)²`, `d_j = θ_j - u_j`, per light and channel: the light is as bright as `usual`, log radiance `u` by the
/// index of the cell, up to a factor.
pub(super) fn add_differences(
    light: &Lighting<'_>,
    usual: impl Fn(usize) -> f32,
    weight: f32,
    sum: &mut CellSum,
) {
    let (per_light, cells) = (light.per_light(), light.of_cells());
    let share = weight / (cells * light.lights).max(1) as f32;
    let lights = light.theta.chunks(per_light).zip(sum.gradient.chunks_mut(per_light));
    for (theta, gradient) in lights {
        let (theta, gradient) = (&theta[..cells], &mut gradient[..cells]);
        for c in 0..3 {
            let channel = theta.iter().skip(c).step_by(3).enumerate();
            let off = channel.map(|(j, t)| t - usual(j));
            let mean = off.clone().sum::<f32>() / (cells / 3).max(1) as f32;
            for (off, g) in off.zip(gradient.iter_mut().skip(c).step_by(3)) {
                // The slope of the mean cancels: deviations sum to 0.
                let d = off - mean;
                sum.cost += f64::from(share * d * d);
                *g += 2.0 * share * d;
            }
        }
    }
}
