//! The sun, found by the shadows that it casts.
//!
//! A light that starts even grows a sun cell by cell, and may stop halfway: shadows of large cells are soft, so those of a sun are first
//! explained by a bright region, and by bluish base colors. A sun in an otherwise even light is tried in every direction instead:
//!
//! ```text
//! F(w, k) = mean_pairs ρ(log (L_a / S_a) - log (L_b / S_b))    S_p = E_p + k V_p(w) (n_p · w)⁺
//! ```
//!
//! `E_p` is what point `p` receives from the even light, `V_p` whether it sees the sun, `L` the luminance that photos show. The fit
//! starts with the sun of least `F`.

use glam::Vec3;
use motes_math::luminance::luminance;
use motes_shading::tracing::{Ray, Tracer, offset_origin};
use rayon::prelude::*;

use super::cost::rho;
use super::pairs::Pair;
use super::problem::{DIM, LightProblem, around};
use super::solve::LitPoints;
use crate::illumination::CellLight;
use crate::observation::{Sample, TracedSurface};

/// Strengths that are tried: irradiance over π of a surface that faces the sun, over the radiance of the even light.
const STRENGTHS: [f32; 9] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
/// Cells of the even light whose directions are looked at closely, and steps along a side of them.
const CLOSELY: usize = 3;
const STEPS: usize = 8;
/// Share of the cost of an even light that a sun has to save: soft boxes save 2 to 6 %, suns 9 to 20 %, over coarse texture 5 %.
const LEAST_SAVING: f64 = 0.08;
/// The same for a sun that gives as much as all other light, which soft boxes do not: they look like one of an eighth to a quarter.
const LEAST_SAVING_OF_STRONG: f64 = 0.04;
const STRONG: f32 = 1.0;
/// A light is sharp where a cell divided so often, with those that touch it, gives this share of all light.
const SHARP_LEVEL: u32 = 2;
const LEAST_SHARE: f32 = 0.1;

/// A sun in an even light.
#[derive(Clone, Copy, Debug)]
struct Sun {
    /// Unit vector toward it, world.
    direction: Vec3,
    /// Irradiance over π of a surface that faces it, over the radiance of the even light.
    strength: f32,
    /// Share of the cost of the even light that it saves.
    saving: f64,
}

/// What a sun is searched with.
struct SunSearch<'a> {
    scene: &'a TracedSurface,
    /// Samples of the rows of `lit`.
    points: Vec<&'a Sample>,
    /// Of radiance 1 from everywhere.
    even: &'a CellLight,
    lit: &'a LitPoints,
    pairs: &'a [Pair],
    /// `σ` of the cost.
    sigma: f32,
    /// Distance at which rays leave the surface, world units.
    ray_bias: f32,
}

impl SunSearch<'_> {
    /// The sun under which near points are most alike; none where an even light leaves them nearly as much so.
    fn find(&self) -> Option<Sun> {
        let shades = Shades {
            log_radiance: self.lit.radiance.iter().map(log_luminance).collect(),
            even: self.lit.shading(&self.even.sources()).into_iter().map(luminance).collect(),
            pairs: self.pairs,
            sigma: self.sigma,
        };
        let without = shades.cost(&vec![0.0; self.points.len()], 0.0);
        let of_cells = (0..self.even.cells.len()).into_par_iter();
        let mut coarse: Vec<(f64, usize)> =
            of_cells.map(|j| (shades.best(&self.cosines_of_cell(j)).0, j)).collect();
        coarse.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let tried: Vec<Vec3> =
            coarse.iter().take(CLOSELY).flat_map(|(_, j)| self.within_cell(*j)).collect();
        let fine = tried.into_par_iter().map(|direction| {
            let (cost, strength) = shades.best(&self.cosines(direction));
            Sun { direction, strength, saving: 1.0 - cost / without }
        });
        let all: Vec<Sun> = fine.collect();
        let best = all.into_iter().reduce(|a, b| if b.saving > a.saving { b } else { a })?;
        let least = if best.strength >= STRONG { LEAST_SAVING_OF_STRONG } else { LEAST_SAVING };
        (best.saving >= least).then_some(best)
    }

    /// Mean of `V (n · w)⁺` over a cell.
    fn cosines_of_cell(&self, j: usize) -> Vec<f32> {
        let transport = &self.lit.transport;
        let per_share = std::f32::consts::PI / self.even.cells[j].solid_angle();
        let of = |p: usize| transport.cells[p * transport.columns + j] * per_share;
        (0..self.points.len()).map(of).collect()
    }

    /// Directions spread evenly over a cell.
    fn within_cell(&self, j: usize) -> impl Iterator<Item = Vec3> {
        let step = |k: usize| (k as f32 + 0.5) / STEPS as f32;
        let at = move |k| [step(k % STEPS), step(k / STEPS)];
        let (cell, orientation) = (&self.even.cells[j], &self.even.orientation);
        (0..STEPS * STEPS).map(at).map(move |[s, t]| cell.direction(s, t, orientation))
    }

    /// `V (n · w)⁺`.
    fn cosines(&self, w: Vec3) -> Vec<f32> {
        let of = |s: &&Sample| {
            let cosine = s.normal.dot(w);
            if !(cosine > 0.0 && s.geometric_normal.dot(w) > 0.0) {
                return 0.0;
            }
            let origin = offset_origin(s.position, s.geometric_normal, w, self.ray_bias);
            if self.scene.tracer.occluded(&Ray::new(origin, w)) { 0.0 } else { cosine }
        };
        self.points.iter().map(of).collect()
    }
}

pub(super) fn log_luminance(radiance: &Vec3) -> f32 {
    luminance(*radiance).max(DIM).ln()
}

/// Points under an even light.
struct Shades<'a> {
    log_radiance: Vec<f32>,
    even: Vec<f32>,
    pairs: &'a [Pair],
    sigma: f32,
}

impl Shades<'_> {
    /// `F`, not divided by the weight of all pairs.
    fn cost(&self, cosines: &[f32], strength: f32) -> f64 {
        let of = |((l, e), c): ((&f32, &f32), &f32)| l - (e + strength * c).ln();
        let points = self.log_radiance.iter().zip(&self.even).zip(cosines);
        let log_base: Vec<f32> = points.map(of).collect();
        let of = |pair: &Pair| {
            let difference = log_base[pair.a as usize] - log_base[pair.b as usize];
            f64::from(pair.weight * rho(difference, self.sigma).0)
        };
        self.pairs.iter().map(of).sum()
    }

    /// The least cost and its strength.
    fn best(&self, cosines: &[f32]) -> (f64, f32) {
        let all = STRENGTHS.map(|strength| (self.cost(cosines, strength), strength));
        all.into_iter().fold((f64::INFINITY, 0.0), |a, b| if b.0 < a.0 { b } else { a })
    }
}

impl LightProblem<'_> {
    /// Puts a sun into every even light whose shadows tell of one, its cells as fine as they may get; the largest share of the cost that
    /// one saves, 0 without any.
    pub(super) fn start_at_suns(
        &self,
        lights: &mut [CellLight],
        rows: &[Vec<u32>],
        lit: &[LitPoints],
    ) -> f64 {
        let levels = self.options.light_levels;
        // Lamps cast shadows of their own, and hardly shine yet.
        if levels == 0 || !self.model.visibility || !self.lamps.seen.is_empty() {
            return 0.0;
        }
        let sun = |l: usize| {
            let pairs = self.near_pairs(&rows[l..=l], &lit[l..=l], self.seed);
            let points = rows[l].iter().map(|&p| &self.samples[p as usize]).collect();
            let search = SunSearch {
                scene: self.scene,
                points,
                even: &lights[l],
                lit: &lit[l],
                pairs: &pairs,
                sigma: self.solve_options().sigma,
                ray_bias: self.ray_bias,
            };
            search.find()
        };
        let suns: Vec<Option<Sun>> = (0..lights.len()).map(sun).collect();
        for sun in suns.iter().flatten() {
            for _ in 0..levels {
                let Some(at) = lights[0].cell_toward(sun.direction) else { continue };
                let hot: Vec<bool> = (0..lights[0].cells.len()).map(|j| j == at).collect();
                let which = around(&lights[0].cells, &hot, levels);
                lights.iter_mut().for_each(|light| light.divide(&which));
            }
        }
        for (light, sun) in lights.iter_mut().zip(&suns) {
            if let Some(sun) = sun
                && let Some(at) = light.cell_toward(sun.direction)
            {
                let irradiance = std::f32::consts::PI * sun.strength;
                light.radiance[at] += Vec3::splat(irradiance / light.cells[at].solid_angle());
            }
        }
        suns.iter().flatten().map(|sun| sun.saving).fold(0.0, f64::max)
    }
}

/// Of every row, the share of the sun that it sees, 0 to 1; none where no part of the light is as sharp, and where lamps shine.
pub(super) fn open_to_sun(light: &CellLight, lit: &LitPoints) -> Option<Vec<f32>> {
    if !light.lamps.is_empty() {
        return None;
    }
    let flux = lit.received_from(&light.sources());
    let sharp = |j: &usize| light.cells[*j].level >= SHARP_LEVEL;
    let cells = || (0..light.cells.len()).filter(sharp);
    let hottest = cells().max_by(|a, b| flux[*a].total_cmp(&flux[*b]).then(b.cmp(a)))?;
    let disc: Vec<usize> =
        cells().filter(|j| light.cells[*j].touches(&light.cells[hottest])).collect();
    let given: f32 = disc.iter().map(|j| flux[*j]).sum();
    if !(given >= LEAST_SHARE * flux.iter().sum::<f32>()) {
        return None;
    }
    let columns = lit.transport.columns;
    let open = |p: usize| {
        let seen = disc.iter().filter(|j| lit.transport.cells[p * columns + **j] > 0.0);
        seen.count() as f32 / disc.len() as f32
    };
    Some((0..lit.radiance.len()).map(open).collect())
}

#[cfg(test)]
mod tests;
