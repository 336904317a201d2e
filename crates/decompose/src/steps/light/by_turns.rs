//! Light at infinity and local light, found by turns.

use glam::Vec3;
use motes_scene::Switch;

use super::local::{self, FoundLocal};
use super::problem::{DIM, LightProblem, RADIUS, base_colors};
use super::solve::{LitPoints, solve};
use crate::illumination::CellLight;

/// Added to the key of the pairs, of those that the local light is found by.
const LOCAL_PAIRS: u64 = 0x10ca1;
/// Neighborhood of those pairs, as [`RADIUS`]: a gradient is told by what is apart.
const LOCAL_RADIUS: f32 = 0.15;
/// Turns of light at infinity and local light.
const LOCAL_TURNS: u64 = 2;

impl LightProblem<'_> {
    /// What the light at infinity leaves of one capture, where neighbors are more alike with it; both are found by turns, since a light
    /// at infinity that stands for a lamp is wrong everywhere else. None of several captures, whose rows are several lights'.
    pub(super) fn local_light(
        &self,
        lights: &mut [CellLight],
        rows: &[Vec<u32>],
        lit: &[LitPoints],
    ) -> Option<FoundLocal> {
        let ([rows_of_one], [lit_of_one]) = (rows, lit) else { return None };
        if self.options.local_light == Switch::Off {
            return None;
        }
        let place = |&p: &u32| {
            let sample = &self.samples[p as usize];
            (sample.position, sample.normal)
        };
        let places: Vec<(Vec3, Vec3)> = rows_of_one.iter().map(place).collect();
        let first = self.local_of(lights, rows, lit_of_one, &places)?;
        if self.options.local_light == Switch::Auto && first.saved() < local::LEAST_SAVING {
            return Some(first);
        }
        let mut light = first.light;
        for turn in 0..LOCAL_TURNS {
            let radiance = lit_of_one.radiance.iter().zip(&places);
            let radiance = radiance.map(|(l, (x, n))| *l / light.factor(*x, *n)).collect();
            let even = [LitPoints { transport: lit_of_one.transport.clone(), radiance }];
            let base = [base_colors(&even[0], &lights[0])];
            let seed = self.seed.wrapping_add(LOCAL_PAIRS + turn);
            let pairs = self.pairs(rows, &even, &base, seed, RADIUS);
            solve(lights, &even, &pairs, &mut [], &self.solve_options());
            light = self.local_of(lights, rows, lit_of_one, &places)?.light;
        }
        Some(FoundLocal { light, ..first })
    }

    /// What this light at infinity leaves.
    fn local_of(
        &self,
        lights: &[CellLight],
        rows: &[Vec<u32>],
        lit: &LitPoints,
        places: &[(Vec3, Vec3)],
    ) -> Option<FoundLocal> {
        let base = [base_colors(lit, lights.first()?)];
        let log = |b: &Vec3| b.max(Vec3::splat(DIM)).map(f32::ln);
        let log_base: Vec<Vec3> = base[0].iter().map(log).collect();
        let seed = self.seed.wrapping_add(LOCAL_PAIRS);
        let pairs = self.pairs(rows, std::slice::from_ref(lit), &base, seed, LOCAL_RADIUS);
        local::find(&local::Points { places, log_base: &log_base }, &pairs, self.distance)
    }
}
