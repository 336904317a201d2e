//! How much noise there is at each time step, and at which of them a sampler looks.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Time steps that Stable Diffusion was trained with.
pub const TRAINED_STEPS: usize = 1000;
const FIRST_BETA: f64 = 0.00085;
const LAST_BETA: f64 = 0.012;
/// The exponent of Karras et al. (2022).
const RHO: f64 = 7.0;

/// Variances of the noise that training adds from step to step
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Schedule {
    /// Linear, as in the demonstrations that were published with IC-Light (DDIM: as trained)
    Published,
    /// Linear in the root, as Stable Diffusion was trained
    Trained,
}

/// How latents lose their noise
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// DPM++ 2M SDE with the levels of Karras et al.
    Dpm,
    /// Euler, ancestral
    EulerA,
    /// DDIM
    Ddim,
}

impl Schedule {
    /// Whether the betas are linear for a sampler.
    pub fn is_linear(self, sampler: Sampler) -> bool {
        self == Self::Published && sampler != Sampler::Ddim
    }
}

/// The share of signal at each time step: products of `1 - beta`.
pub fn signal(linear: bool, first: f64, last: f64, count: usize) -> Vec<f64> {
    let share = |k: usize| k as f64 / (count.max(2) - 1) as f64;
    let beta = |k: usize| match linear {
        true => first + share(k) * (last - first),
        false => (first.sqrt() + share(k) * (last.sqrt() - first.sqrt())).powi(2),
    };
    let mut product = 1.0;
    let mut next = |k: usize| {
        product *= 1.0 - beta(k);
        product
    };
    (0..count).map(&mut next).collect()
}

/// Where a sampler looks, from the most noise to the least.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The sampler.
    pub sampler: Sampler,
    /// Time steps.
    pub times: Vec<f64>,
    /// Noise over signal at each step, and after the last one.
    pub sigmas: Vec<f64>,
}

impl Plan {
    /// `steps` steps.
    pub fn new(sampler: Sampler, schedule: Schedule, steps: usize) -> Self {
        let linear = schedule.is_linear(sampler);
        let signal = signal(linear, FIRST_BETA, LAST_BETA, TRAINED_STEPS);
        let sigmas: Vec<f64> = signal.iter().map(|s| ((1.0 - s) / s).sqrt()).collect();
        match sampler {
            Sampler::Dpm => Self::karras(&sigmas, steps),
            Sampler::EulerA => Self::even(&sigmas, steps),
            Sampler::Ddim => Self::leading(&sigmas, steps),
        }
    }

    /// Levels of noise after Karras et al. (2022), equation 5, and the nearest time steps in the logarithm of the noise.
    fn karras(trained: &[f64], steps: usize) -> Self {
        let (low, high) = (trained[0].powf(1.0 / RHO), trained[TRAINED_STEPS - 1].powf(1.0 / RHO));
        let ramp = |k: usize| k as f64 / (steps.max(2) - 1) as f64;
        let mut sigmas: Vec<f64> =
            (0..steps).map(|k| (high + ramp(k) * (low - high)).powf(RHO)).collect();
        let logs: Vec<f64> = trained.iter().map(|s| s.ln()).collect();
        let time = |sigma: &f64| {
            let wanted = sigma.max(1e-10).ln();
            let above = logs.partition_point(|log| *log <= wanted);
            let below = above.saturating_sub(1).min(logs.len() - 2);
            let weight = (logs[below] - wanted) / (logs[below] - logs[below + 1]);
            (below as f64 + weight.clamp(0.0, 1.0)).round_ties_even()
        };
        let times = sigmas.iter().map(time).collect();
        sigmas.push(0.0);
        Self { sampler: Sampler::Dpm, times, sigmas }
    }

    /// Time steps from the last to the first, evenly, which need not be whole.
    fn even(trained: &[f64], steps: usize) -> Self {
        let most = (TRAINED_STEPS - 1) as f64;
        // One step is the first of `linspace`, which is then turned around.
        let time = |k: usize| match steps {
            1 => 0.0,
            _ => f64::from((most * (steps - 1 - k) as f64 / (steps - 1) as f64) as f32),
        };
        let times: Vec<f64> = (0..steps).map(time).collect();
        let between = |t: &f64| {
            let below = (t.floor() as usize).min(TRAINED_STEPS - 2);
            let weight = t - below as f64;
            trained[below] * (1.0 - weight) + trained[below + 1] * weight
        };
        let mut sigmas: Vec<f64> = times.iter().map(between).collect();
        sigmas.push(0.0);
        Self { sampler: Sampler::EulerA, times, sigmas }
    }

    /// Every `1000 / steps`th time step from the second on, down to the level of the first.
    fn leading(trained: &[f64], steps: usize) -> Self {
        let ratio = TRAINED_STEPS / steps.max(1);
        let time = |k: usize| ((steps - 1 - k) * ratio + 1).min(TRAINED_STEPS - 1);
        let times: Vec<usize> = (0..steps).map(time).collect();
        let mut sigmas: Vec<f64> = times.iter().map(|t| trained[*t]).collect();
        // The level before the last time step is none; the published configuration takes the first one.
        sigmas.push(
            times.last().and_then(|t| t.checked_sub(ratio)).map_or(trained[0], |t| trained[t]),
        );
        Self { sampler: Sampler::Ddim, times: times.iter().map(|t| *t as f64).collect(), sigmas }
    }

    /// Steps.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// The first step for a share of noise: latents that begin there keep the rest of what they were.
    pub fn first(&self, share: f64) -> usize {
        let kept = ((self.len() as f64 * share) as usize).min(self.len());
        (self.len() - kept).min(self.len().saturating_sub(1))
    }
}

/// Time steps from a share of noise down, evenly, as in Instruct-NeRF2NeRF; the level after the last one is clean.
pub fn times_below(noise: f64, steps: usize, count: usize) -> Vec<usize> {
    let top = ((noise * count as f64) as usize).min(count - 1) as f64;
    let time = |k: usize| (top - top * k as f64 / steps as f64).round_ties_even() as usize;
    (0..steps).map(time).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_levels_of_noise_are_those_of_the_demonstrations() {
        let largest = |schedule| Plan::new(Sampler::Dpm, schedule, 25).sigmas[0];
        assert!((largest(Schedule::Published) - 25.1461).abs() < 1e-3);
        assert!((largest(Schedule::Trained) - 14.6146).abs() < 1e-3);
    }

    #[test]
    fn plans_of_any_length_go_down_and_are_finite() {
        for sampler in [Sampler::Dpm, Sampler::EulerA, Sampler::Ddim] {
            for steps in [1, 2, 3, 25, 28, 50, 999, 1000] {
                let plan = Plan::new(sampler, Schedule::Published, steps);
                assert_eq!((plan.len(), plan.sigmas.len()), (steps, steps + 1));
                assert!(plan.sigmas.iter().all(|s| s.is_finite() && *s >= 0.0));
                assert!(plan.sigmas.windows(2).all(|w| w[0] >= w[1]), "{sampler:?} {steps}");
                assert!(plan.times.iter().all(|t| (0.0..1000.0).contains(t)));
                for share in [1e-6, 0.5, 0.9, 1.0] {
                    assert!(plan.first(share) < steps);
                }
            }
        }
        assert_eq!(times_below(1.0, 4, 1000), [999, 749, 500, 250]);
        assert_eq!(times_below(0.02, 1, 1000), [20]);
    }
}
