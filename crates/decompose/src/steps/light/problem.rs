//! Rounds of tracing, solving and dividing cells.

use std::sync::Arc;

use glam::Vec3;
use motes_scene::Switch;
use motes_shading::environment::Orientation;

use super::cost::SolveOptions;
use super::evidence::prior_log_base;
use super::lamp_saving::{SmoothLight, saved};
use super::lamps::Lamps;
use super::local::{FoundLocal, Place};
use super::options::Options;
use super::sky::seen_sky;
use super::solve::{LitPoints, solve};
use super::transport::{TracedCells, TransportOptions, bounce};
use crate::appearance::ModelOptions;
use crate::illumination::seen_sky::SeenSky;
use crate::illumination::{Cell, CellLight};
use crate::observation::{Observed, Sample, SeenView, TracedSurface};
use crate::state::State;

/// Cells of level 0: 11.25 degrees wide.
pub(super) const COLUMNS: usize = 32;
/// A cell is divided when more than this share of all received light comes from it.
pub(super) const SHARE: f32 = 0.03;
/// How much smoother the sky is that lamps are first found beside.
const STIFF: f32 = 100.0;
/// Weight of light from above where photos show no sky and shadows tell of no sun.
const ABOVE: f32 = 0.1;
/// Weight of a clear sky where shadows tell of a sun and photos show no sky.
const CLEAR_SKY: f32 = 0.1;
/// Rays to every lamp from every point.
const LAMP_RAYS: u32 = 32;
/// Radiance below which what photos show has no color that could be told, photo units.
pub(super) const DIM: f32 = 1e-3;

/// Points and the captures that show them.
#[derive(Debug)]
pub(crate) struct LightProblem<'a> {
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
    /// Pieces of the surface that may shine.
    pub lamps: Lamps,
    /// Per sample: logarithm of a base color that was predicted elsewhere, up to one factor per photo.
    pub prior_log_base: Option<Vec<Vec3>>,
    /// What photos show of the sky.
    pub sky: Arc<SeenSky>,
    /// Whether shadows tell of a sun.
    pub has_sun: bool,
    /// Rays and weights.
    pub options: &'a Options,
    /// The usual range of base colors, and whether there are shadows.
    pub model: &'a ModelOptions,
    /// Distance at which rays leave the surface, world units.
    pub ray_bias: f32,
    /// Key of the random numbers.
    pub seed: u64,
}

/// The light found and what was measured on the way.
#[derive(Debug, Default)]
pub(crate) struct FoundLight {
    /// One per capture, with common cells.
    pub lights: Vec<CellLight>,
    /// Cells of every round.
    pub cells: Vec<usize>,
    /// Cost of every round, before and after.
    pub costs: Vec<(f64, f64)>,
    /// The lamp of every vertex of the surface, from 1; 0 for none. Empty where there are none.
    pub lamp_of_vertex: Vec<u32>,
    /// Share of all light on the points that lamps give.
    pub lamp_share: f32,
    /// Costs of a smooth light without and with lamps, where there may be any.
    pub lamp_costs: Option<(f64, f64)>,
    /// Share of the cost of an even light that a sun saves; 0 without one.
    pub sun_saving: f64,
    /// The light that is not at infinity, of a single capture.
    pub local: Option<FoundLocal>,
}

impl<'a> LightProblem<'a> {
    /// What is known of the light of this state.
    pub(crate) fn of(state: &'a State<'_>, options: &'a Options) -> Self {
        let Observed { scene, samples, vertex_radiance, views, .. } = &state.observed;
        let light = &state.illumination;
        Self {
            scene,
            samples,
            vertex_radiance,
            lamps: Lamps::known(scene, &light.lamp_of_vertex, light.cells.first()),
            lights: state.inputs.light_count(),
            distance: state.camera_distance,
            orientation: state.orientation(),
            prior_log_base: prior_log_base(samples, views, &state.inputs.known.base_color_priors),
            sky: seen_sky(state),
            has_sun: false,
            options,
            model: state.inputs.model,
            ray_bias: state.ray_bias(),
            seed: state.inputs.seed,
        }
    }

    /// With the pieces of the surface that photos show clipped; without where there are several lights, since a lamp may be
    /// dark in one and bright in the other.
    pub(crate) fn with_candidates(self, views: &[SeenView<'_>]) -> Self {
        if self.lights != 1 || self.options.lamps == Switch::Off {
            return self;
        }
        let sent = self.vertex_radiance.first().map_or(&[][..], Vec::as_slice);
        Self { lamps: Lamps::candidates(self.scene, views, sent), ..self }
    }

    /// Finds the light of every capture, starting from an even white one.
    pub(crate) fn solve(&mut self) -> FoundLight {
        let mut traced = TracedCells::default();
        let lamp_costs = self.weigh_lamps(&mut traced);
        let bounces = self.bounces();
        let mut lights = vec![self.even(); self.lights];
        let mut found = FoundLight { lamp_costs, ..FoundLight::default() };
        let levels = self.options.light_levels;
        for round in 0..=levels {
            let (mut rows, mut lit) = self.lit_points(&lights[0], &bounces, &mut traced);
            if round == 0 {
                found.cells.push(lights[0].cells.len());
                found.sun_saving = self.start_at_suns(&mut lights, &rows, &lit);
                self.has_sun = found.sun_saving > 0.0;
                if lights[0].cells.len() > found.cells[0] {
                    (rows, lit) = self.lit_points(&lights[0], &bounces, &mut traced);
                }
                self.start(&mut lights, &rows, &lit);
            }
            // The first pairs are near each other and may have any color; they are chosen again once the light is
            // roughly known.
            for pass in 0..if round == 0 { 2 } else { 1u64 } {
                let seed = self.seed.wrapping_add(pass);
                let pairs = match round {
                    0 => self.near_pairs(&rows, &lit, seed),
                    _ => self.pairs_under(&lights, &rows, &lit, seed),
                };
                let cost = solve(&mut lights, &lit, &pairs, &mut [], &self.solve_options());
                found.costs.push(cost);
            }
            if round > 0 {
                found.cells.push(lights[0].cells.len());
            }
            if round == levels {
                found.lamp_share = lamp_share(&lights[0], &lit[0]);
                let is_outdoors = self.has_sun || !self.sky.is_empty();
                let place = Place { lamp_share: found.lamp_share, is_outdoors };
                found.local = self.local_light(&mut lights, &rows, &lit, place);
            } else {
                let hot = hot_cells(&lights, &lit);
                let which = around(&lights[0].cells, &hot, levels);
                lights.iter_mut().for_each(|light| light.divide(&which));
            }
        }
        found.lamp_of_vertex.clone_from(&self.lamps.of_vertex);
        found.lights = lights;
        found
    }

    /// Leaves out pieces that light nothing, and those that leave the base colors of what they light no more alike; costs of a
    /// smooth light without and with all of them, where there were any.
    fn weigh_lamps(&mut self, traced: &mut TracedCells) -> Option<(f64, f64)> {
        if self.lamps.seen.is_empty() {
            return None;
        }
        let with = self.smooth(traced);
        let lamps = std::mem::take(&mut self.lamps);
        let without = self.smooth(traced);
        let saved = saved(&with, &without, self.solve_options().sigma);
        self.lamps = lamps.kept(&with.light, &with.lit, &saved);
        Some((without.cost, with.cost))
    }

    /// A light of large cells, and what it lights.
    fn smooth(&self, traced: &mut TracedCells) -> SmoothLight {
        let bounces = self.bounces();
        let mut lights = vec![self.even()];
        let (rows, mut lit) = self.lit_points(&lights[0], &bounces, traced);
        self.start(&mut lights, &rows, &lit);
        let pairs = self.near_pairs(&rows, &lit, self.seed);
        let (_, cost) = solve(&mut lights, &lit, &pairs, &mut [], &self.solve_options());
        SmoothLight { cost, light: lights.swap_remove(0), lit: lit.swap_remove(0), pairs }
    }

    /// An even white light, and lamps that send hardly more than what is seen of them.
    fn even(&self) -> CellLight {
        let even = CellLight::uniform(COLUMNS, COLUMNS / 2, Vec3::ONE, self.orientation);
        CellLight { lamps: self.lamps.start(), ..even }
    }

    /// Makes lamps as bright as they have to be beside an even sky: one that is free before them takes their place, with a sun
    /// for each. Nothing where there are no lamps.
    fn start(&self, lights: &mut [CellLight], rows: &[Vec<u32>], lit: &[LitPoints]) {
        if self.lamps.seen.is_empty() {
            return;
        }
        let pairs = self.near_pairs(rows, lit, self.seed);
        let by_shading = self.solve_options();
        let options = SolveOptions { smooth: STIFF * by_shading.smooth, ..by_shading };
        solve(lights, lit, &pairs, &mut [], &options);
    }

    fn transport_options(&self) -> TransportOptions {
        TransportOptions {
            rays_per_side: self.options.light_rays,
            bounce_rays: 64,
            lamp_rays: LAMP_RAYS,
            bias: self.ray_bias,
            visibility: self.model.visibility,
            seed: self.seed,
        }
    }

    /// Weights of the likeness of base colors under a light that only shading tells.
    pub(crate) fn solve_options(&self) -> SolveOptions {
        let others = self.options.light_priors.iter();
        SolveOptions {
            smooth: self.options.weight_smooth_light,
            white: self.options.weight_white_light,
            // A sky that photos show sets the scale.
            scale: if self.sky.sets_scale() { 0.0 } else { self.model.weight_albedo_range },
            above: if self.sky.is_empty() && !self.has_sun { ABOVE } else { 0.0 },
            clear_sky: if self.sky.is_empty() && self.has_sun { CLEAR_SKY } else { 0.0 },
            color: self.options.weight_light_color,
            glossy: 0.0,
            typical_base_color: self.model.typical_base_color,
            sigma: 0.05,
            steps: 200,
            rate: 0.1,
            sky: Arc::clone(&self.sky),
            others: others.map(|prior| (prior.prior().name(), prior.weight())).collect(),
        }
    }

    /// What the surface itself sends to every sample, per capture.
    pub(crate) fn bounces(&self) -> Vec<Vec<Vec3>> {
        let options = self.transport_options();
        (0..self.lights)
            .map(|l| match self.vertex_radiance.get(l) {
                Some(radiance) => {
                    bounce(self.scene, self.samples, radiance, &self.lamps.emitters, &options)
                }
                None => vec![Vec3::ZERO; self.samples.len()],
            })
            .collect()
    }

    /// Samples per capture (those that its photos show), and their rows, with what they receive of the cells of `light`. Cells that
    /// `traced` knows are not traced again.
    pub(crate) fn lit_points(
        &self,
        light: &CellLight,
        bounces: &[Vec<Vec3>],
        traced: &mut TracedCells,
    ) -> (Vec<Vec<u32>>, Vec<LitPoints>) {
        let (scene, samples, options) = (self.scene, self.samples, self.transport_options());
        let transport = traced.transport(scene, samples, light, &options);
        let transport = transport.with_lamps(scene, samples, &self.lamps.emitters, &options);
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
}

/// Radiance over irradiance, per lit point.
pub(crate) fn base_colors(lit: &LitPoints, light: &CellLight) -> Vec<Vec3> {
    lit.radiance.iter().zip(lit.shading(&light.sources())).map(|(l, s)| *l / s).collect()
}

/// Whether more than [`SHARE`] of what all points receive comes from a cell, under any light.
fn hot_cells(lights: &[CellLight], lit: &[LitPoints]) -> Vec<bool> {
    let mut hot = vec![false; lights[0].cells.len()];
    for (light, lit) in lights.iter().zip(lit) {
        let flux = lit.received_from(&light.sources());
        let total: f32 = flux.iter().sum();
        hot.iter_mut().zip(&flux).for_each(|(hot, f)| *hot |= *f > SHARE * total);
    }
    hot
}

/// Share of what all points receive that lamps give.
fn lamp_share(light: &CellLight, lit: &LitPoints) -> f32 {
    let flux = lit.received_from(&light.sources());
    let of_lamps: f32 = flux[light.cells.len().min(flux.len())..].iter().sum();
    of_lamps / flux.iter().sum::<f32>().max(f32::MIN_POSITIVE)
}

/// Hot cells and those that touch one and are not finer: a bright spot may turn out to lie next door.
pub(super) fn around(cells: &[Cell], hot: &[bool], levels: u32) -> Vec<bool> {
    let near_hot = |cell: &Cell| {
        let mut others = cells.iter().zip(hot).filter(|(_, hot)| **hot);
        others.any(|(other, _)| other.level >= cell.level && cell.touches(other))
    };
    cells.iter().map(|cell| cell.level < levels && near_hot(cell)).collect()
}
