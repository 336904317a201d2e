//! Rounds of tracing, solving and dividing cells.

use glam::Vec3;
use motes_shading::environment::Orientation;

use super::cells::{Cell, CellLight};
use super::glossy::{Glossy, GlossyScene};
use super::pairs::{Pair, PairOptions, choose_pairs};
use super::solve::{LitPoints, SolveOptions, solve};
use super::transport::{Transport, TransportOptions, bounce};
use crate::buffers::TracedSurface;
use crate::materials::find::FoundMaterials;
use crate::options::DecomposeOptions;
use crate::samples::Sample;

/// Cells of level 0: 11.25 degrees wide.
const COLUMNS: usize = 32;
/// A cell is divided when more than this share of all received light comes from it.
const SHARE: f32 = 0.03;
/// Neighbourhood of pairs, as a share of the distance between camera and point.
const RADIUS: f32 = 0.05;
/// Neighbours that pairs are drawn from: some shadow edges lie between.
const AMONG: usize = 200;
/// Difference of log chromaticity at which base colours are no longer alike. Sun and sky differ in colour, so points that look
/// alike before the light is known are mostly lit alike: choosing by looks would hide every shadow from the fit.
const CHROMA: f32 = 0.4;
/// Weight of pairs that are not both on a flat piece: their normals err by degrees, which flattens the light.
const UNSURE: f32 = 0.2;
/// Weight of a pair of one point under two lights against a full pair.
const SAME_POINT: f32 = 4.0;

/// Where reflections are fitted, the light is smoother by this factor (they tell single cells apart, and their errors with them), ...
const SMOOTHER: f32 = 2.0;
/// ... differences in colour of neighbouring cells count this many times, squared, beside those in brightness, ...
const TINT: f32 = 3.0;
/// ... and the mean base colour is held: lobes in the wrong place would make the light dim.
const HOLD: f32 = 30.0;

/// Points and the captures that show them.
#[derive(Debug)]
pub struct LightProblem<'a> {
    /// Geometry.
    pub scene: &'a TracedSurface,
    /// Points with observations.
    pub samples: &'a [Sample],
    /// Radiance of the surface per capture and vertex; empty when indirect light is left out.
    pub vertex_radiance: &'a [Vec<Vec3>],
    /// Number of captures.
    pub lights: usize,
    /// Median distance between cameras and points, world units.
    pub distance: f32,
    /// Axes of the maps.
    pub orientation: Orientation,
    /// Per sample: logarithm of a base colour that was predicted elsewhere, up to one factor per photo.
    pub prior_log_base: Option<&'a [Vec3]>,
}

/// The light found and what was measured on the way.
#[derive(Debug)]
pub struct FoundLight {
    /// One per capture, with common cells.
    pub lights: Vec<CellLight>,
    /// Cells of every round.
    pub cells: Vec<usize>,
    /// Cost of every round, before and after.
    pub costs: Vec<(f64, f64)>,
}

impl LightProblem<'_> {
    /// Finds the light of every capture, starting from an even white one.
    pub fn solve(&self, options: &DecomposeOptions, seed: u64) -> FoundLight {
        let even = CellLight::uniform(COLUMNS, COLUMNS / 2, Vec3::ONE, self.orientation);
        let mut lights = vec![even; self.lights];
        let transport_options = self.transport_options(options, seed);
        let bounces = self.bounces(&transport_options);
        let mut found = FoundLight { lights: Vec::new(), cells: Vec::new(), costs: Vec::new() };
        let mut base: Vec<Vec<Vec3>> = Vec::new();
        for round in 0..=options.light_levels {
            let transport =
                Transport::trace(self.scene, self.samples, &lights[0], &transport_options);
            let (rows, lit) = self.lit_points(&transport, &bounces);
            // The first pairs are near each other and may have any colour; they are chosen again once the light is
            // roughly known.
            for pass in 0..if round == 0 { 2 } else { 1u64 } {
                let pairs = self.pairs(&rows, &lit, &base, options, seed.wrapping_add(pass));
                found.costs.push(solve(
                    &mut lights,
                    &lit,
                    &pairs,
                    &mut [],
                    &solve_options(options),
                ));
            }
            base = lit.iter().zip(&lights).map(|(l, light)| base_colors(l, light)).collect();
            found.cells.push(lights[0].cells.len());
            if round < options.light_levels {
                let hot = hot_cells(&lights, &lit);
                let which = around(&lights[0].cells, &hot, options.light_levels);
                lights.iter_mut().for_each(|light| light.divide(&which));
            }
        }
        found.lights = lights;
        found
    }

    fn transport_options(&self, options: &DecomposeOptions, seed: u64) -> TransportOptions {
        TransportOptions {
            rays_per_side: options.light_rays,
            bounce_rays: 64,
            bias: RAY_BIAS * self.distance,
            visibility: options.visibility,
            seed,
        }
    }

    /// What the surface itself sends to every sample, per capture.
    fn bounces(&self, options: &TransportOptions) -> Vec<Vec<Vec3>> {
        (0..self.lights)
            .map(|l| match self.vertex_radiance.get(l) {
                Some(radiance) => bounce(self.scene, self.samples, radiance, options),
                None => vec![Vec3::ZERO; self.samples.len()],
            })
            .collect()
    }

    /// Moves the light, from where shading put it, to where it explains what parts of the materials `found` reflect too. The mean
    /// base colour stays.
    pub(crate) fn fit_to_reflections(
        &self,
        lights: &mut [CellLight],
        found: &FoundMaterials,
        options: &DecomposeOptions,
        seed: u64,
    ) {
        let Some(first) = lights.first() else { return };
        let transport_options = self.transport_options(options, seed);
        let bounces = self.bounces(&transport_options);
        let transport = Transport::trace(self.scene, self.samples, first, &transport_options);
        let (rows, lit) = self.lit_points(&transport, &bounces);
        let base: Vec<Vec<Vec3>> =
            lit.iter().zip(&*lights).map(|(l, light)| base_colors(l, light)).collect();
        let pairs = self.pairs(&rows, &lit, &base, options, seed);
        let mut glossy: Vec<Glossy> = (0..self.lights)
            .map(|l| {
                let scene = GlossyScene {
                    scene: self.scene,
                    samples: self.samples,
                    found,
                    vertex_radiance: self.vertex_radiance.get(l).map_or(&[], Vec::as_slice),
                    lobes: options.lobes.into(),
                    ray_bias: transport_options.bias,
                    seed,
                };
                Glossy::new(scene.points(&rows[l], l as u32, &lights[l]), &base[l])
            })
            .collect();
        let solve_options = SolveOptions {
            smooth: SMOOTHER * options.weight_smooth_light,
            scale: HOLD,
            tint: TINT,
            glossy: options.weight_reflected_light,
            typical_base_color: typical(&base),
            rate: 0.05,
            ..solve_options(options)
        };
        solve(lights, &lit, &pairs, &mut glossy, &solve_options);
    }

    /// Samples per capture (those that its photos show), and their rows.
    fn lit_points(
        &self,
        transport: &Transport,
        bounces: &[Vec<Vec3>],
    ) -> (Vec<Vec<u32>>, Vec<LitPoints>) {
        (0..self.lights)
            .map(|l| {
                let seen = self.samples.iter().enumerate();
                let (rows, radiance): (Vec<u32>, Vec<Vec3>) =
                    seen.filter_map(|(p, s)| Some((p as u32, s.body_radiance(l)?))).unzip();
                let mut transport = transport.gather(&rows);
                transport.bounce = rows.iter().map(|&p| bounces[l][p as usize]).collect();
                (rows, LitPoints { transport, radiance })
            })
            .unzip()
    }

    fn pairs(
        &self,
        rows: &[Vec<u32>],
        lit: &[LitPoints],
        base: &[Vec<Vec3>],
        options: &DecomposeOptions,
        seed: u64,
    ) -> Vec<Pair> {
        let mut all = Vec::new();
        let mut start = 0;
        let mut row_of = vec![u32::MAX; self.samples.len()];
        for (l, (rows, lit)) in rows.iter().zip(lit).enumerate() {
            let positions: Vec<Vec3> =
                rows.iter().map(|&p| self.samples[p as usize].position).collect();
            let (colors, chroma) =
                base.get(l).map_or((&lit.radiance, f32::INFINITY), |base| (base, CHROMA));
            let pair_options = PairOptions {
                count: 8,
                among: AMONG,
                radius: RADIUS * self.distance,
                chroma,
                seed,
            };
            all.extend(choose_pairs(&positions, colors, &pair_options).into_iter().map(|pair| {
                let [a, b] = [pair.a, pair.b].map(|row| rows[row as usize] as usize);
                let sure = self.samples[a].sheet != 0 && self.samples[b].sheet != 0;
                let weight = options.weight_base_color * if sure { 1.0 } else { UNSURE };
                Pair {
                    a: pair.a + start,
                    b: pair.b + start,
                    weight: weight * pair.weight,
                    expected: self.prior_log_base.map_or(Vec3::ZERO, |prior| prior[a] - prior[b]),
                }
            }));
            for (row, &p) in (start..).zip(rows) {
                let other = std::mem::replace(&mut row_of[p as usize], row);
                if other != u32::MAX {
                    all.push(Pair { a: other, b: row, weight: SAME_POINT, expected: Vec3::ZERO });
                }
            }
            start += rows.len() as u32;
        }
        all
    }
}

/// Distance at which rays leave the surface, as a share of the distance between camera and point: some pixels.
pub(crate) const RAY_BIAS: f32 = 3e-3;

fn solve_options(options: &DecomposeOptions) -> SolveOptions {
    SolveOptions {
        smooth: options.weight_smooth_light,
        white: options.weight_white_light,
        scale: options.weight_albedo_range,
        tint: 0.0,
        glossy: 0.0,
        typical_base_color: options.typical_base_color,
        sigma: 0.05,
        steps: 200,
        rate: 0.1,
    }
}

/// Mean base colour, geometric, one number for all channels.
fn typical(base: &[Vec<Vec3>]) -> f32 {
    let log = |b: &Vec3| b.max(Vec3::splat(1e-4)).map(f32::ln).element_sum() / 3.0;
    let all = || base.iter().flatten();
    (all().map(log).sum::<f32>() / all().count().max(1) as f32).exp()
}

fn base_colors(lit: &LitPoints, light: &CellLight) -> Vec<Vec3> {
    lit.radiance.iter().zip(lit.shading(&light.radiance)).map(|(l, s)| *l / s).collect()
}

/// Whether more than [`SHARE`] of what all points receive comes from a cell, under any light.
fn hot_cells(lights: &[CellLight], lit: &[LitPoints]) -> Vec<bool> {
    let mut hot = vec![false; lights[0].cells.len()];
    for (light, lit) in lights.iter().zip(lit) {
        let received = lit.transport.transposed(&vec![Vec3::ONE; lit.radiance.len()]);
        let flux: Vec<f32> =
            received.iter().zip(&light.radiance).map(|(t, e)| (*t * *e).element_sum()).collect();
        let total: f32 = flux.iter().sum();
        hot.iter_mut().zip(&flux).for_each(|(hot, f)| *hot |= *f > SHARE * total);
    }
    hot
}

/// Hot cells and those that touch one and are not finer: a bright spot may turn out to lie next door.
fn around(cells: &[Cell], hot: &[bool], levels: u32) -> Vec<bool> {
    let near_hot = |cell: &Cell| {
        let mut others = cells.iter().zip(hot).filter(|(_, hot)| **hot);
        others.any(|(other, _)| other.level >= cell.level && cell.touches(other))
    };
    cells.iter().map(|cell| cell.level < levels && near_hot(cell)).collect()
}
