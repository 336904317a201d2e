//! A small light out of view, from the shadows that it casts.
//!
//! Cells of 15 degrees smear a sun. Where they put most light, a light without extent is tried on a grid of directions around, finer and
//! finer; it stays when it explains the shading better than the cells alone.

use glam::DVec3;
use motes_scene::ImageF32;
use motes_shading::environment::Orientation;
use rayon::prelude::*;

use super::Splat;
use super::evidence::SurfaceSample;
use super::lights::column;
use super::shadows::{Region, ShadowMap};
use super::solve::{Shading, Solution};
use crate::sphere::{texel_direction, texel_solid_angle};

/// Cells whose neighborhood is searched.
const PEAKS: usize = 3;
/// Steps of the search, degrees; each looks at a ring of 6 directions around the best one.
const STEPS_DEG: [f64; 5] = [10.0, 6.0, 4.0, 2.0, 1.0];
/// The error that is left, over that of the cells that it stands for, from which it is believed: it is one unknown in place of many.
const BELIEVED: f64 = 1.02;
/// Cells within this of a lamp send nothing beside it, degrees.
const AROUND_DEG: f64 = 28.0;
/// Rounds of the solution of a trial, from that without the lamp on.
const TRIAL_ROUNDS: usize = 6;
const ROUNDS: usize = 20;
/// Radius of its disc in the map, degrees: the sun's would be smaller than a texel.
const RADIUS_DEG: f64 = 1.5;

/// A light without extent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamp {
    /// Unit, world.
    pub(super) direction: DVec3,
    /// Irradiance of a surface that faces it.
    pub(super) power: f64,
    /// Share of the light on a level surface.
    pub(super) share: f64,
}

/// The solution with a lamp where one helps, else `even`. `candidates` are directions with the flux that cells send.
pub(super) fn find_lamp(
    splat: &Splat<'_>,
    region: &Region,
    points: &[SurfaceSample],
    shading: &Shading,
    even: &Solution,
    candidates: &[(DVec3, f64)],
) -> (Solution, Option<Lamp>) {
    let mut peaks: Vec<&(DVec3, f64)> = candidates.iter().filter(|c| c.1 > 0.0).collect();
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    let reach = 10.0 * region.radius;
    let try_at = |direction: DVec3| {
        let map = ShadowMap::new(splat, region, direction, reach);
        let off = near(candidates, direction, even.light.len());
        let more = shading.with(&column(&map, direction, 1.0, points), 0.0, &off);
        let mut start = even.clone();
        start.light.iter_mut().zip(&off).filter(|(_, off)| **off).for_each(|(y, _)| *y = 0.0);
        (direction, more.solve_from(start, TRIAL_ROUNDS, true))
    };
    let mut best: Option<(DVec3, Solution)> = None;
    for (start, _) in peaks.into_iter().take(PEAKS) {
        let mut here = try_at(*start);
        for step in STEPS_DEG {
            let center = here.0;
            let (x, y) = center.any_orthonormal_pair();
            let around = |k: u32| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 6.0).sin_cos();
                let aside = (x * cos + y * sin) * step.to_radians().tan();
                try_at((center + aside).normalize())
            };
            let ring: Vec<(DVec3, Solution)> = (0..6).into_par_iter().map(around).collect();
            for other in ring {
                if other.1.error < here.1.error {
                    here = other;
                }
            }
        }
        if best.as_ref().is_none_or(|b| here.1.error < b.1.error) {
            best = Some(here);
        }
    }
    match best {
        Some((direction, solution)) if solution.error < BELIEVED * even.error => {
            let map = ShadowMap::new(splat, region, direction, reach);
            let off = near(candidates, direction, even.light.len());
            let more = shading.with(&column(&map, direction, 1.0, points), 0.0, &off);
            let mut solution = more.solve_from(solution, ROUNDS, true);
            let power = solution.light.pop().unwrap_or(0.0);
            (solution, Some(Lamp { direction, power, share: 0.0 }))
        }
        _ => (even.clone(), None),
    }
}

/// Which unknowns are cells around a lamp: it sends what they would.
fn near(candidates: &[(DVec3, f64)], direction: DVec3, unknowns: usize) -> Vec<bool> {
    let mut off = vec![false; unknowns];
    let cosine = AROUND_DEG.to_radians().cos();
    for (off, (cell, _)) in off.iter_mut().zip(candidates) {
        *off = cell.dot(direction) > cosine;
    }
    off
}

impl Lamp {
    /// Adds its disc to a map, with all its power, white.
    pub(super) fn add_to(&self, map: &mut ImageF32, orientation: &Orientation) {
        let (w, h) = (map.width, map.height);
        let toward = orientation.map_from_world(self.direction);
        let least = RADIUS_DEG.to_radians().max(std::f64::consts::PI / h as f64).cos();
        let inside: Vec<usize> = (0..w * h)
            .filter(|i| texel_direction(i % w, i / w, w, h).dot(toward) >= least)
            .collect();
        let area: f64 = inside.iter().map(|i| texel_solid_angle(i / w, w, h)).sum();
        for i in inside {
            let radiance = (self.power / area) as f32;
            map.data[3 * i..3 * i + 3].iter_mut().for_each(|v| *v += radiance);
        }
    }
}
