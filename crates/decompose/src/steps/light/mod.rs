//! The light that leaves the base colors of like points alike.

mod by_turns;
pub(crate) mod cost;
mod evidence;
pub(crate) mod glossy;
mod lamp_saving;
pub(crate) mod lamps;
mod likely_pairs;
mod local;
mod options;
pub(crate) mod pairs;
mod priors;
pub(crate) mod problem;
mod sky;
pub(crate) mod solve;
mod sun;
pub(crate) mod transport;

use std::sync::Arc;

use crate::report::{Term, numbers};
use crate::state::{Illumination, State};
use motes_math::luminance::luminance;
use motes_scene::{ScaleAnchor, Switch};

pub use cost::SolveOptions;
pub use options::Options;
pub use priors::{CellSum, LIGHT_PRIORS, LightPrior, Lighting, PointSum, Slopes, WeightedPrior};

/// Indirect light below this share of the irradiance is left out.
const LEAST_INDIRECT: f32 = 0.005;

/// Finds the light of every capture, unless it is known, and whether light from the surface itself counts.
pub fn run(state: &mut State<'_>, options: &Options) -> Vec<Term> {
    let (mut sharp, mut sun, mut lamps, mut local) = (None, None, None, None);
    if state.inputs.known.lights.is_empty() {
        let problem = problem::LightProblem::of(state, options);
        let sky = !problem.sky.is_empty();
        let found = problem.with_candidates(&state.observed.views).solve();
        sharp = sharp_light(&found);
        sun = Some(sun_term(&found));
        lamps = lamps_term(&found);
        local = found.local;
        state.light_cells = found.cells;
        let anchor = if sky { ScaleAnchor::Sky } else { ScaleAnchor::Environment };
        state.illumination = Illumination {
            anchor,
            lamp_of_vertex: found.lamp_of_vertex,
            ..Illumination::of_cells(found.lights)
        };
    }
    let local = local.map(|found| {
        let kept = found.is_kept(options.local_light);
        let term = found.term(kept);
        if kept {
            state.observed.light_evenly(Arc::new(found.light));
        }
        term
    });
    let mut share = 0.0;
    if state.has_indirect() {
        share = evidence::share_of_bounce(state);
        if state.inputs.model.indirect == Switch::Auto && share < LEAST_INDIRECT {
            state.observed.vertex_radiance.clear();
        }
    }
    std::iter::once(indirect(state, share))
        .chain(sun)
        .chain(sharp)
        .chain(lamps)
        .chain(local)
        .collect()
}

/// What lamps give; none where no photo shows a surface clipped.
fn lamps_term(found: &problem::FoundLight) -> Option<Term> {
    let (without, with) = found.lamp_costs?;
    let lamps = &found.lights.first()?.lamps;
    let (count, percent) = (lamps.len(), 100.0 * found.lamp_share);
    let excess = lamps.iter().map(|l| luminance(l.radiance) / luminance(l.seen).max(1e-4));
    let excess = excess.fold(0.0, f32::max);
    let change = 100.0 * (with / without.max(f64::MIN_POSITIVE) - 1.0);
    Some(Term {
        name: "lamps".into(),
        kept: count > 0,
        evidence: if count > 0 {
            format!(
                "{count} clipped pieces of the surface give {percent:.0} % of the light, the brightest {excess:.0} times what is seen of it"
            )
        } else {
            format!(
                "no clipped piece of the surface makes neighbors that it lights differently more alike; all together change the cost by {change:+.1} %"
            )
        },
        numbers: numbers([
            ("lamps", Some(count as f64)),
            ("share_of_irradiance", Some(f64::from(found.lamp_share))),
            ("cost_without", Some(without)),
            ("cost", Some(with)),
        ]),
    })
}

fn indirect(state: &State<'_>, share: f32) -> Term {
    let percent = 100.0 * share;
    Term {
        name: "indirect".into(),
        kept: state.has_indirect(),
        evidence: format!("{percent:.1} % of the irradiance comes from the surface itself"),
        numbers: numbers([("share_of_irradiance", Some(f64::from(share)))]),
    }
}

/// Whether the fit started with a sun.
fn sun_term(found: &problem::FoundLight) -> Term {
    let percent = 100.0 * found.sun_saving;
    let kept = found.sun_saving > 0.0;
    Term {
        name: "sun".into(),
        kept,
        evidence: if kept {
            format!(
                "near points are {percent:.1} % more alike under a sun than under an even light"
            )
        } else {
            "no sun leaves near points more alike than an even light does".into()
        },
        numbers: numbers([("saving", Some(found.sun_saving))]),
    }
}

fn sharp_light(found: &problem::FoundLight) -> Option<Term> {
    // The first round is solved twice.
    let mut costs = found.costs.iter().skip(1).map(|(_, after)| *after);
    let (first, smooth) = (*found.cells.first()?, costs.next()?);
    let (last, cost) = (*found.cells.last()?, costs.next_back().unwrap_or(smooth));
    let share = 100.0 * problem::SHARE;
    let width = 360 / problem::COLUMNS;
    Some(Term {
        name: "sharp light".into(),
        kept: last > first,
        evidence: if last > first {
            format!(
                "{last} cells after dividing those that give more than {share:.0} % of the light"
            )
        } else {
            format!("no cell of {width} degrees gives more than {share:.0} % of the light")
        },
        numbers: numbers([("cost_smooth", Some(smooth)), ("cost", Some(cost))]),
    })
}
