//! The measured front of time against quality, as settings that can be interpolated.
//!
//! The points were chosen from sweeps on several captures (`docs/benchmarks`); `--preset` takes one,
//! `--time-budget` a place between two of them.

use serde::Serialize;

use crate::options::Preset;

/// Resolutions of the schedule, as factors on the photos' size.
pub(crate) const SCALES: [f64; 3] = [0.25, 0.5, 1.0];

/// One stretch of the resolution schedule.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stage {
    /// Factor on the photos' size.
    pub scale: f64,
    /// Share of the steps.
    pub share: f64,
}

/// What grows with the time at hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Settings {
    /// Optimizer steps.
    pub(crate) iterations: f64,
    /// Most Gaussians at any time.
    pub(crate) max_gaussians: f64,
    /// Steps between refinements.
    pub(crate) refine_every: f64,
    /// Share of the steps at each of [`SCALES`]; they sum to 1.
    pub(crate) shares: [f64; 3],
    /// Share of the learning rates left at the end.
    pub(crate) lr_final: f64,
    /// Most times as many steps that a capture may get whose photos see little of the scene each.
    pub(crate) longest: f64,
}

/// From a second to many minutes. The first is below `draft`: for budgets that hold no more.
pub(crate) const FRONT: [Settings; 4] = [
    Settings {
        iterations: 150.0,
        max_gaussians: 12_000.0,
        refine_every: 40.0,
        shares: [0.75, 0.25, 0.0],
        lr_final: 1.0,
        longest: 1.0,
    },
    Settings {
        iterations: 750.0,
        max_gaussians: 30_000.0,
        refine_every: 100.0,
        shares: [0.5, 0.35, 0.15],
        lr_final: 1.0,
        longest: 1.0,
    },
    Settings {
        iterations: 1500.0,
        max_gaussians: 100_000.0,
        refine_every: 150.0,
        shares: [0.25, 0.35, 0.4],
        lr_final: 0.1,
        longest: 2.5,
    },
    Settings {
        iterations: 2000.0,
        max_gaussians: 200_000.0,
        refine_every: 200.0,
        shares: [0.2, 0.3, 0.5],
        lr_final: 0.1,
        longest: 2.5,
    },
];

impl Settings {
    /// The point of a preset.
    pub(crate) fn of(preset: Preset) -> Self {
        match preset {
            Preset::Draft => FRONT[1],
            Preset::Balanced => FRONT[2],
            Preset::High => FRONT[3],
        }
    }

    /// Between `self` (0) and `other` (1): counts geometrically, shares linearly.
    pub(crate) fn toward(self, other: Self, t: f64) -> Self {
        let geometric = |a: f64, b: f64| (a.ln() * (1.0 - t) + b.ln() * t).exp();
        Self {
            iterations: geometric(self.iterations, other.iterations),
            max_gaussians: geometric(self.max_gaussians, other.max_gaussians),
            refine_every: geometric(self.refine_every, other.refine_every),
            shares: std::array::from_fn(|i| self.shares[i] * (1.0 - t) + other.shares[i] * t),
            lr_final: geometric(self.lr_final, other.lr_final),
            longest: geometric(self.longest, other.longest),
        }
    }

    /// The schedule.
    pub(crate) fn stages(&self) -> Vec<Stage> {
        let stages = SCALES.into_iter().zip(self.shares);
        stages.map(|(scale, share)| Stage { scale, share }).collect()
    }
}

/// The settings whose predicted seconds are `seconds`, given the prediction for each of [`FRONT`].
pub(crate) fn settings_for(seconds: f64, predicted: &[f64; FRONT.len()]) -> Settings {
    for i in 0..FRONT.len() - 1 {
        let (low, high) = (predicted[i].max(1e-9), predicted[i + 1].max(2e-9));
        if seconds <= low {
            return FRONT[i];
        }
        if seconds < high {
            let t = (seconds / low).ln() / (high / low).ln();
            return FRONT[i].toward(FRONT[i + 1], t);
        }
    }
    FRONT[FRONT.len() - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_grow_continuously_with_the_time() {
        let predicted = [1.0, 10.0, 50.0, 300.0];
        assert_eq!(settings_for(0.1, &predicted), FRONT[0]);
        assert_eq!(settings_for(1e6, &predicted), FRONT[3]);
        let near = settings_for(50.0 - 1e-9, &predicted);
        assert!((near.max_gaussians - FRONT[2].max_gaussians).abs() < 1.0);
        let mut before = FRONT[0];
        for i in 0..200 {
            let now = settings_for(0.5 * 1.04f64.powi(i), &predicted);
            assert!(
                now.max_gaussians >= before.max_gaussians && now.iterations >= before.iterations
            );
            assert!(now.max_gaussians < 1.1 * before.max_gaussians, "no jumps");
            assert!((now.shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            before = now;
        }
    }
}
