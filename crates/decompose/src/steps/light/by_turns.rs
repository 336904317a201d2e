//! Light at infinity and local light, found by turns.

use glam::Vec3;
use motes_scene::Switch;

use super::likely_pairs::by_agreement;
use super::local::{self, FoundLocal, Place};
use super::pairs::Pair;
use super::problem::{DIM, LightProblem, base_colors};
use super::solve::{LitPoints, solve};
use crate::illumination::CellLight;

/// Added to the key of the pairs, of those that the local light is found by.
const LOCAL_PAIRS: u64 = 0x10ca1;
/// Turns of light at infinity and local light where no lamps are found: a light at infinity that stands for a lamp is wrong everywhere
/// else. With lamps it stands for none, and would drift with the local light from face to face.
const LOCAL_TURNS: u64 = 2;

impl LightProblem<'_> {
    /// What the light at infinity leaves of one capture, where neighbors are more alike with it; without lamps both are found by turns.
    /// None of several captures, whose rows are several lights'.
    pub(super) fn local_light(
        &self,
        lights: &mut [CellLight],
        rows: &[Vec<u32>],
        lit: &[LitPoints],
        place: Place,
    ) -> Option<FoundLocal> {
        let ([rows_of_one], [lit_of_one]) = (rows, lit) else { return None };
        if self.options.local_light == Switch::Off {
            return None;
        }
        let facing = |&p: &u32| {
            let sample = &self.samples[p as usize];
            (sample.position, sample.normal)
        };
        let places: Vec<(Vec3, Vec3)> = rows_of_one.iter().map(facing).collect();
        let (base, pairs) = self.local_problem(lights, rows, lit_of_one);
        let solver = local::solver(&places, self.distance)?;
        // All pairs judge alike: the steep light beside a lamp, which is the evidence, is what photos agree about least.
        let costs = local::judge(&solver, &base, &pairs);
        let agreement = self.agreement(rows_of_one);
        let fit = |base: &[Vec3], pairs: &[Pair]| {
            local::fit(&solver, base, &by_agreement(pairs, &agreement))
        };
        let light = fit(&base, &pairs);
        let spread = local::spread(&light, &places);
        let mut found = FoundLocal { light, costs, spread, place };
        if !found.is_kept(self.options.local_light) {
            return Some(found);
        }
        let transport = lit_of_one.transport.clone();
        let mut even = [LitPoints { transport, radiance: Vec::new() }];
        let turns = if lights[0].lamps.is_empty() { LOCAL_TURNS } else { 0 };
        for turn in 0..turns {
            let radiance = lit_of_one.radiance.iter().zip(&places);
            even[0].radiance =
                radiance.map(|(l, (x, n))| *l / found.light.factor(*x, *n)).collect();
            let seed = self.seed.wrapping_add(LOCAL_PAIRS + turn);
            let pairs = self.pairs_under(lights, rows, &even, seed);
            solve(lights, &even, &pairs, &mut [], &self.solve_options());
            let (base, pairs) = self.local_problem(lights, rows, lit_of_one);
            found.light = fit(&base, &pairs);
        }
        Some(found)
    }

    /// Logarithms of what this light at infinity leaves, and the pairs that should be alike in it.
    fn local_problem(
        &self,
        lights: &[CellLight],
        rows: &[Vec<u32>],
        lit: &LitPoints,
    ) -> (Vec<Vec3>, Vec<Pair>) {
        let base = [base_colors(lit, &lights[0])];
        let log = |b: &Vec3| b.max(Vec3::splat(DIM)).map(f32::ln);
        let log_base = base[0].iter().map(log).collect();
        let seed = self.seed.wrapping_add(LOCAL_PAIRS);
        (log_base, self.local_pairs(rows, std::slice::from_ref(lit), &base, seed))
    }
}
