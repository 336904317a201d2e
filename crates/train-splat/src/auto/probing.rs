//! When probes run, and how long they may be.

use crate::plan::Plan;

/// Shorter probes say nothing.
pub(crate) const MIN_PROBE_STEPS: u32 = 12;
/// Share of the run after which exposures are decided: rough colors stand, and the coarse
/// resolution still makes probes cheap.
pub(crate) const EXPOSURE_AT: f64 = 0.24;
/// Share of the second stage after which the SH degree is decided. Not earlier: at the first, coarse
/// resolution degree 3 gained 0.03 dB where 0.4 dB followed within 100 steps of the second stage, and
/// nothing where nothing followed.
const DEGREE_AT: f64 = 0.3;
/// Share of the run's work that all probes together may take, by [`step_cost`]; a third of it is for
/// the background. Measured, it is less: there are fewer Gaussians early in a run.
pub(crate) const PROBE_SHARE: f64 = 0.13;

/// Relative cost of a step: a part for the Gaussians and one for the pixels.
fn step_cost(scale: f64) -> f64 {
    0.2 + 0.8 * scale * scale
}

/// Progress at which the SH degree is decided.
pub(crate) fn degree_at(plan: &Plan) -> f64 {
    match plan.stages.as_slice() {
        [first, second, ..] => (first.share + DEGREE_AT * second.share).max(EXPOSURE_AT),
        _ => EXPOSURE_AT + DEGREE_AT / 2.0,
    }
}

/// Steps of each of `probes` probes at `progress` that together take `share` of a run of the preset's
/// own length: a longer one needs no longer probes.
pub(crate) fn probe_steps(plan: &Plan, probes: usize, share: f64, progress: f64) -> u32 {
    let run: f64 = plan.stages.iter().map(|s| s.share * step_cost(s.scale)).sum();
    let probe = step_cost(plan.stages[plan.stage_at(progress)].scale);
    let steps = f64::from(plan.iterations) / plan.steps_factor;
    (steps * share * run / (probes.max(1) as f64 * probe)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::FitOptions;

    #[test]
    fn probes_stay_within_their_share() {
        for schedule in ["0.25:0.25,0.5:0.35,1:0.4", "1:1", "0.5:1"] {
            let options =
                FitOptions { resolution_schedule: Some(schedule.into()), ..FitOptions::default() };
            let plan = Plan::new(&options, 20).unwrap();
            let run: f64 = plan.stages.iter().map(|s| s.share * step_cost(s.scale)).sum();
            let probe =
                step_cost(plan.stages[0].scale) * f64::from(probe_steps(&plan, 6, 0.1, 0.0));
            assert!(6.0 * probe <= 0.1 * run * f64::from(plan.iterations));
        }
    }
}
