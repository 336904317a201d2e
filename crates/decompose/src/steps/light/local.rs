//! The part of the light that is not at infinity ([`LocalLight`]), found from what the light at infinity leaves.
//!
//! With `b_p = L_p / S_p` the base colors under the light at infinity, the log factors `l_j` at the anchors minimize
//!
//! ```text
//! mean_pairs w ρ(log b_a - log b_b - (g_a - g_b)) + λ mean_j |l_j - mean of its neighbors|² + μ mean_j |l_j|²
//!     + κ Σ_d s_d |mean of g over what faces the way d|²
//! ```
//!
//! with `g_p = Σ_j w_pj l_j`, the shares `s_d` of the points, and the pairs of the light itself: neighbors have one base color. Curvature is
//! dear, so a gradient over a wall is light and a step from one thing to the next is base color. Pairs face one way, so they tell nothing of
//! one wall against another: that is left to the light at infinity and the lamps. Reweighted least squares; conjugate gradients.

mod facings;
mod farthest;
mod solve;

use glam::Vec3;
use motes_scene::Switch;

use self::farthest::farthest;
use self::solve::Solver;
use super::pairs::Pair;
use crate::illumination::{LightAnchor, LocalLight, feature};
use crate::report::{Term, numbers};

/// Distance over which the factor changes, as a share of the distance between cameras and points.
const REACH: f32 = 0.15;
/// Anchors at most.
const MOST_ANCHORS: usize = 1200;
/// One point in so many is left out to judge the fit.
const LEFT_OUT: usize = 4;
/// Share of the cost of the pairs left out that it has to save.
const LEAST_SAVING: f64 = 0.1;
/// Standard deviation of its logarithm over the points that it has to have: base colors that change a little from place to place look
/// like weak light. Beside lamps light is known to be near, and less is enough; outdoors it is far, and more is needed.
const LEAST_SPREAD: f64 = 0.2;
const LEAST_SPREAD_BESIDE_LAMPS: f64 = 0.15;
const LEAST_SPREAD_OUTDOORS: f64 = 0.45;
/// Share of the light from which lamps count.
const LAMP_SHARE: f32 = 0.05;

/// Where photos were taken, as far as their light tells.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Place {
    /// Share of all light on the points that lamps give.
    pub lamp_share: f32,
    /// Whether a sun or a sky lights it.
    pub is_outdoors: bool,
}

impl Place {
    /// Whether lamps give a share of the light that tells.
    fn has_lamps(self) -> bool {
        self.lamp_share >= LAMP_SHARE
    }

    fn least_spread(self) -> f64 {
        match (self.has_lamps(), self.is_outdoors) {
            (true, _) => LEAST_SPREAD_BESIDE_LAMPS,
            (false, true) => LEAST_SPREAD_OUTDOORS,
            (false, false) => LEAST_SPREAD,
        }
    }
}

/// What was found, and what it saves of the cost of pairs that were left out.
#[derive(Debug)]
pub(crate) struct FoundLocal {
    pub light: LocalLight,
    /// Cost of the pairs left out, without and with a first fit.
    pub costs: [f64; 2],
    /// Standard deviation of the logarithm of a first fit over the points, mean of the channels.
    pub spread: f64,
    /// Where.
    pub place: Place,
}

impl FoundLocal {
    /// Share of the cost that it saves.
    pub(crate) fn saved(&self) -> f64 {
        let [without, with] = self.costs;
        if without > 0.0 { 1.0 - with / without } else { 0.0 }
    }

    /// Whether it is part of the model.
    pub(crate) fn is_kept(&self, wanted: Switch) -> bool {
        let is_evident = self.saved() >= LEAST_SAVING && self.spread >= self.place.least_spread();
        wanted == Switch::On || is_evident
    }

    /// In words and numbers.
    pub(crate) fn term(&self, kept: bool) -> Term {
        let (saved, spread) = (100.0 * self.saved(), self.spread);
        Term {
            name: "local light".into(),
            kept,
            evidence: format!(
                "irradiance that varies over the scene by a factor of {:.2} makes neighbors that were left out {saved:.0} % more alike{}",
                spread.exp(),
                if kept { "" } else { ": less than it must be worth" },
            ),
            numbers: numbers([
                ("cost_without", Some(self.costs[0])),
                ("cost", Some(self.costs[1])),
                ("log_spread", Some(spread)),
                ("anchors", Some(self.light.anchors().len() as f64)),
            ]),
        }
    }
}

/// A fit of the local light of points (position, world, and unit normal) at a median `distance` from the cameras; none where there is
/// nothing to fit.
pub(super) fn solver(places: &[(Vec3, Vec3)], distance: f32) -> Option<Solver> {
    Some(Solver::new(anchored(places, REACH * distance)?, places))
}

/// Fits the local light to `log_base`, logarithms of radiance over irradiance at the points.
pub(super) fn fit(solver: &Solver, log_base: &[Vec3], pairs: &[Pair]) -> LocalLight {
    solver.light(&solver.solve(log_base, pairs))
}

/// Standard deviation of the log factors at the points, mean of the channels.
pub(super) fn spread(light: &LocalLight, places: &[(Vec3, Vec3)]) -> f64 {
    let mean = |v: Vec3| f64::from(v.element_sum()) / 3.0;
    let all = places.iter().map(|(x, n)| mean(light.log_factor(*x, *n)));
    let (n, sum, squares) = all.fold((0.0, 0.0, 0.0), |(n, s, q), v| (n + 1.0, s + v, q + v * v));
    let n = f64::max(n, 1.0);
    f64::sqrt((squares / n - (sum / n).powi(2)).max(0.0))
}

/// What [`fit`] saves of the pairs of points that it is not told of.
pub(super) fn judge(solver: &Solver, log_base: &[Vec3], pairs: &[Pair]) -> [f64; 2] {
    let is_left_out =
        |pair: &Pair| [pair.a, pair.b].iter().any(|p| (*p as usize).is_multiple_of(LEFT_OUT));
    let (judges, told): (Vec<Pair>, Vec<Pair>) = pairs.iter().copied().partition(is_left_out);
    let by_others = solver.solve(log_base, &told);
    let nothing = vec![Vec3::ZERO; by_others.len()];
    [nothing, by_others].map(|factors| solver.cost(&factors, log_base, &judges))
}

/// Farthest points as anchors, until every point has one within what place and normal reach or there are enough.
fn anchored(places: &[(Vec3, Vec3)], reach: f32) -> Option<LocalLight> {
    if !(reach > 0.0) {
        return None;
    }
    let features: Vec<[f32; 6]> = places.iter().map(|(x, n)| feature(*x, *n, reach)).collect();
    let squared = |a: &[f32; 6], b: &[f32; 6]| -> f32 {
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
    };
    let anchor = |k: usize| {
        let (position, normal) = places[k];
        LightAnchor { position, normal, log_factor: Vec3::ZERO }
    };
    let chosen = farthest(&features, squared, 1.0, MOST_ANCHORS);
    let anchors = chosen.into_iter().map(anchor).collect();
    LocalLight::new(anchors, reach)
}

#[cfg(test)]
mod tests {
    use super::super::likely_pairs::{LOCAL_RADIUS, LOCAL_TURN};
    use super::super::pairs::tests::fold;
    use super::super::pairs::{Likeness, PairOptions, choose_pairs};
    use super::*;

    fn find(
        places: &[(Vec3, Vec3)],
        log_base: &[Vec3],
        pairs: &[Pair],
        distance: f32,
    ) -> Option<FoundLocal> {
        let solver = solver(places, distance)?;
        let (costs, light) = (judge(&solver, log_base, pairs), fit(&solver, log_base, pairs));
        let spread = spread(&light, places);
        Some(FoundLocal { light, costs, spread, place: Place::default() })
    }

    /// A wall of 40 x 40 points, of `paint` (log) at its places, beside a lamp of `strength`.
    fn wall(paint: impl Fn(usize, usize) -> f32, strength: f32) -> FoundLocal {
        let lamp = Vec3::new(0.3, 0.5, 0.25);
        let place = |i: usize| Vec3::new((i % 40) as f32 / 40.0, (i / 40) as f32 / 40.0, 0.0);
        let lit = |x: Vec3| (1.0 + strength * 0.02 / (x - lamp).length_squared()).ln();
        let places: Vec<(Vec3, Vec3)> = (0..1600).map(|i| (place(i), Vec3::Z)).collect();
        let log_base: Vec<Vec3> =
            (0..1600).map(|i| Vec3::splat(lit(place(i)) + paint(i % 40, i / 40))).collect();
        let pairs: Vec<Pair> = (0..1600u32)
            .flat_map(|i| {
                [1u32, 2, 40, 81].map(|step| Pair { a: i, b: (i + step) % 1600, weight: 1.0 })
            })
            .filter(|p| (places[p.a as usize].0 - places[p.b as usize].0).length() < 0.1)
            .collect();
        find(&places, &log_base, &pairs, 1.0).unwrap()
    }

    /// Standard deviation of what is left of the lamp on the wall.
    fn left_of_lamp(found: &FoundLocal, strength: f32) -> f32 {
        let bare = wall(|_, _| 0.0, 0.0);
        assert!(bare.saved().abs() < 1e-6 || bare.costs[0] < 1e-9);
        let lamp = Vec3::new(0.3, 0.5, 0.25);
        let rest: Vec<f32> = (0..1600)
            .map(|i| {
                let x = Vec3::new((i % 40) as f32 / 40.0, (i / 40) as f32 / 40.0, 0.0);
                let lit = (1.0 + strength * 0.02 / (x - lamp).length_squared()).ln();
                lit - found.light.log_factor(x, Vec3::Z).x
            })
            .collect();
        let mean = rest.iter().sum::<f32>() / 1600.0;
        (rest.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / 1600.0).sqrt()
    }

    #[test]
    fn the_glow_of_a_lamp_is_light_and_not_paint() {
        let found = wall(|_, _| 0.0, 20.0);
        let left = left_of_lamp(&found, 20.0);
        println!("saved {:.3}, left {left:.3}", found.saved());
        assert!(found.saved() > 0.5 && left < 0.1, "{} {left}", found.saved());
        // Outdoors a weak glow may be base colors that drift; a strong one is light.
        let strong = wall(|_, _| 0.0, 200.0);
        println!("spread {:.3}, of the strong {:.3}", found.spread, strong.spread);
        assert!(found.is_kept(Switch::Auto), "{}", found.spread);
        let at = |place: Place, found: FoundLocal| FoundLocal { place, ..found };
        let outdoors = Place { lamp_share: 0.0, is_outdoors: true };
        let found = at(outdoors, found);
        assert!(!found.is_kept(Switch::Auto) && found.is_kept(Switch::On));
        let beside_lamps = at(Place { lamp_share: 0.3, ..outdoors }, found);
        assert!(beside_lamps.is_kept(Switch::Auto), "{}", beside_lamps.spread);
        assert!(at(outdoors, strong).is_kept(Switch::Auto));
        let faint = wall(|_, _| 0.0, 5.0);
        assert!(!faint.is_kept(Switch::Auto), "{}", faint.spread);
    }

    #[test]
    fn paint_is_paint() {
        // Two halves, and a checkerboard.
        let halves = wall(|x, _| if x < 20 { 0.0 } else { 1.0 }, 0.0);
        let step = halves.light.log_factor(Vec3::new(0.9, 0.5, 0.0), Vec3::Z).x
            - halves.light.log_factor(Vec3::new(0.1, 0.5, 0.0), Vec3::Z).x;
        println!("halves: saved {:.3}, step {step:.3}", halves.saved());
        assert!(step.abs() < 0.3, "{step}");
        let board = wall(|x, y| 0.5 * ((x / 5 + y / 5) % 2) as f32, 0.0);
        println!("board: saved {:.3}", board.saved());
        assert!(board.saved() < LEAST_SAVING, "{}", board.saved());
        assert!(![halves, board].iter().any(|found| found.is_kept(Switch::Auto)));
    }

    /// Mean log factor of a light wall (log 1) over that of the dark floor (log 0) before it, with pairs that are alike in normal
    /// within `turn`, and points between them in the corner that are neither.
    fn step_at_a_fold(turn: f32, corner: &[(Vec3, Vec3)]) -> f32 {
        let places = [&fold()[..], corner].concat();
        let paint = |i: usize| [0.0, 1.0, 0.5][i / 400];
        let log_base: Vec<Vec3> = (0..places.len()).map(|i| Vec3::splat(paint(i))).collect();
        let likeness = Likeness { radius: LOCAL_RADIUS, chroma: f32::INFINITY };
        let feature = |(x, n): &(Vec3, Vec3)| likeness.facing_feature(*x, Vec3::ONE, *n, turn);
        let features: Vec<[f32; 8]> = places.iter().map(feature).collect();
        let pairs = choose_pairs(&features, &PairOptions { count: 8, among: 200, seed: 1 });
        let light = fit(&solver(&places, 1.0).unwrap(), &log_base, &pairs);
        let factor = |(x, n): &(Vec3, Vec3)| light.log_factor(*x, *n).x;
        let mean = |of: &[(Vec3, Vec3)]| of.iter().map(factor).sum::<f32>() / 400.0;
        mean(&places[400..800]) - mean(&places[..400])
    }

    #[test]
    fn a_wall_that_is_lighter_than_the_floor_is_painted() {
        let (alike, step) = (step_at_a_fold(1e9, &[]), step_at_a_fold(LOCAL_TURN, &[]));
        println!("the fold's pairs: whole {alike:.3}, by their normals {step:.3}");
        assert!(alike > 0.5 && step.abs() < 0.1, "{alike} {step}");
    }

    #[test]
    fn a_round_corner_does_not_tie_a_wall_to_the_floor() {
        let at = |i: u16| {
            let turn = f32::from(i % 9 + 1) * std::f32::consts::PI / 20.0;
            (Vec3::new(f32::from(i) / 320.0, 0.0, 0.0), Vec3::new(0.0, turn.sin(), turn.cos()))
        };
        let step = step_at_a_fold(LOCAL_TURN, &(0..160).map(at).collect::<Vec<_>>());
        println!("step {step:.3}");
        assert!(step.abs() < 0.35, "{step}");
    }

    #[test]
    fn a_lamp_beside_a_painted_wall_is_found() {
        let found = wall(|x, y| 0.5 * ((x / 5 + y / 5) % 2) as f32, 20.0);
        let left = left_of_lamp(&found, 20.0);
        println!("saved {:.3}, left {left:.3}", found.saved());
        assert!(left < 0.2, "{left}");
    }

    #[test]
    fn nothing_is_found_of_nothing() {
        assert!(find(&[], &[], &[], 1.0).is_none());
        let one = [(Vec3::ZERO, Vec3::Z)];
        let found = find(&one, &[Vec3::ONE], &[], 1.0).unwrap();
        assert_eq!(found.light.log_factor(Vec3::ZERO, Vec3::Z), Vec3::ZERO);
        assert!(find(&one, &[Vec3::ONE], &[], f32::NAN).is_none());
    }
}
