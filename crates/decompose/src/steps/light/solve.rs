//! The light that leaves the base colors of like points alike.
//!
//! Unknown: log radiance `θ` of every cell. With `S_p = Σ_j T_pj exp θ_j + I_p` (irradiance over π) and
//! the photos' radiances `L_p`, base color is `L_p / S_p`, and the cost is
//!
//! ```text
//! F = mean_pairs w ρ(log (L_a / S_a) - log (L_b / S_b))  likeness of base colors
//!   + λ_smooth mean ρ(θ_i - θ_j) over touching cells        smooth light, edges allowed,
//!   + λ_smooth λ_color mean (d - mean_c d)², d = θ_i - θ_j  and neighbors of one color
//!   + λ_white  Σ_c (m_c - mean_c m)², m = mean_p log S_p    light is nearly white on the whole,
//!   + λ_white / 100 mean (θ_c - mean_c θ)²                  and, much less, from everywhere
//!   + λ_scale  (mean_p log (L_p / S_p) - log anchor)²       scale, which the photos do not tell
//! ```
//!
//! Once materials are known, what glossy points reflect counts too (`super::glossy`):
//!
//! ```text
//!   + λ_glossy mean_views w ρ((b S_p + Σ_j W_j exp θ_j + R - L) / mean L)   b is found anew every few steps
//! ```
//!
//! With several captures the points of each are rows of their own under a light of their own, and pairs join
//! a point with itself under another light, which tells base color and light apart.
//!
//! Lamps of the scene are columns of `T` like cells; they have no neighbors, and send at least what the photos show of them.
//!
//! All is per channel, with `ρ(x) = sqrt(x² + σ²) - σ`. Minimized by Adam (Kingma & Ba 2015).

use glam::Vec3;
use motes_math::adam::{AdamOptions, adam_step};
use rayon::prelude::*;

use super::cost::{SolveOptions, rho};
use super::glossy::Glossy;
use super::pairs::Pair;
use super::priors::{CellSum, LIGHT_PRIORS, LightPrior, Lighting, PointSum, Slopes, Sources};
use super::transport::Transport;
use crate::illumination::seen_sky::SeenSky;
use crate::illumination::{Cell, CellLight};

/// Smallest irradiance over π that a logarithm is taken of, photo units.
const FLOOR: f32 = 1e-4;
/// A lamp sends at most this many times what is seen of it: one that hardly lights anything could be of any brightness.
const MOST_EXCESS: f32 = 300.0;
/// Logarithms of radiances stay within this.
const LOG_RANGE: f32 = 14.0;

/// Steps after which base colors of what reflects are found anew.
const REFRESH: u32 = 5;

/// Points under one light.
#[derive(Debug)]
pub(crate) struct LitPoints {
    /// What they receive.
    pub transport: Transport,
    /// Radiance that the photos show, one per row of the transport.
    pub radiance: Vec<Vec3>,
}

impl LitPoints {
    /// Irradiance over π of every point under these radiances of the cells.
    pub(crate) fn shading(&self, light: &[Vec3]) -> Vec<Vec3> {
        let at = |p| {
            (self.transport.direct(p, light) + self.transport.bounce[p]).max(Vec3::splat(FLOOR))
        };
        (0..self.radiance.len()).into_par_iter().map(at).collect()
    }
}

impl LitPoints {
    /// What all points together receive from every source of this radiance, all channels.
    pub(crate) fn received_from(&self, sources: &[Vec3]) -> Vec<f32> {
        let received = self.transport.transposed(&vec![Vec3::ONE; self.radiance.len()]);
        received.iter().zip(sources).map(|(t, e)| (*t * *e).element_sum()).collect()
    }
}

fn radiances(theta: &[f32]) -> Vec<Vec3> {
    theta.chunks_exact(3).map(|t| Vec3::new(t[0].exp(), t[1].exp(), t[2].exp())).collect()
}

/// The priors that count, and their weights.
type Weighted = Vec<(&'static dyn LightPrior, f32)>;

fn weighted(options: &SolveOptions) -> Weighted {
    let all = LIGHT_PRIORS.iter().map(|prior| (*prior, prior.weight(options)));
    all.filter(|(_, weight)| *weight != 0.0).collect()
}

/// Cost and gradient by `θ`, channels interleaved, one light after the other.
pub(crate) fn cost_and_gradient(
    theta: &[f32],
    lit: &[LitPoints],
    pairs: &[Pair],
    sources: &Sources,
    glossy: &[Glossy],
    options: &SolveOptions,
    priors: &[(&dyn LightPrior, f32)],
) -> (f64, Vec<f32>) {
    let columns = lit.first().map_or(0, |l| l.transport.columns);
    let light = radiances(theta);
    let lights: Vec<&[Vec3]> = light.chunks_exact(columns.max(1)).collect();
    let shading: Vec<Vec3> =
        lit.iter().zip(&lights).flat_map(|(l, light)| l.shading(light)).collect();
    let radiance: Vec<Vec3> = lit.iter().flat_map(|l| l.radiance.iter().copied()).collect();
    let log_base = log_base(&radiance, &shading);

    let lighting = Lighting {
        theta,
        lights: lit.len(),
        sources,
        shading: &shading,
        log_base: &log_base,
        options,
    };
    let mut points = PointSum::default();
    let by_likeness = likeness(&log_base, pairs, options.sigma, &mut points.cost);
    points.by_log_base.push(Slopes::Each(by_likeness));
    for (prior, weight) in priors {
        prior.add_points(&lighting, *weight, &mut points);
    }
    // ∂S/∂θ = T exp θ.
    let mut cost = points.cost;
    let mut by_shading: Vec<Vec3> =
        shading.iter().enumerate().map(|(p, s)| points.by_shading(p, *s)).collect();
    let mut by_cell = vec![Vec3::ZERO; light.len()];
    let mut start = 0;
    for (l, glossy) in glossy.iter().enumerate() {
        let count = lit[l].radiance.len();
        let by_cell = &mut by_cell[l * columns..(l + 1) * columns];
        let by_shading = &mut by_shading[start..start + count];
        cost += glossy.add(&shading[start..start + count], lights[l], options, by_shading, by_cell);
        start += count;
    }
    let mut gradient = Vec::with_capacity(theta.len());
    let mut start = 0;
    for ((l, light), by_cell) in lit.iter().zip(&lights).zip(by_cell.chunks(columns.max(1))) {
        let end = start + l.radiance.len();
        let sums = l.transport.transposed(&by_shading[start..end]);
        for ((sum, by), e) in sums.iter().zip(by_cell).zip(*light) {
            gradient.extend(((*sum + *by) * *e).to_array());
        }
        start = end;
    }

    let mut cells = CellSum { cost, gradient };
    for (prior, weight) in priors {
        prior.add_cells(&lighting, *weight, &mut cells);
    }
    (cells.cost, cells.gradient)
}

/// Logarithm of radiance over irradiance over π.
pub(super) fn log_base(radiance: &[Vec3], shading: &[Vec3]) -> Vec<Vec3> {
    let of = |(l, s): (&Vec3, &Vec3)| l.max(Vec3::splat(FLOOR)).ln() - s.ln();
    radiance.iter().zip(shading).map(of).collect()
}

/// Mean cost of pairs whose base colors differ, added to `cost`, and its slope by every logarithm.
pub(super) fn likeness(log_base: &[Vec3], pairs: &[Pair], sigma: f32, cost: &mut f64) -> Vec<Vec3> {
    let mut by_log_base = vec![Vec3::ZERO; log_base.len()];
    let total: f32 = pairs.iter().map(|p| p.weight).sum::<f32>().max(1e-6);
    for pair in pairs {
        let difference = log_base[pair.a as usize] - log_base[pair.b as usize];
        let w = pair.weight / total;
        let mut slope = Vec3::ZERO;
        for c in 0..3 {
            let (value, by) = rho(difference[c], sigma);
            *cost += f64::from(w * value);
            slope[c] = w * by;
        }
        by_log_base[pair.a as usize] += slope;
        by_log_base[pair.b as usize] -= slope;
    }
    by_log_base
}

/// Moves the radiances of `lights`, which have the same cells, to a minimum; returns the cost before and after.
pub(crate) fn solve(
    lights: &mut [CellLight],
    lit: &[LitPoints],
    pairs: &[Pair],
    glossy: &mut [Glossy],
    options: &SolveOptions,
) -> (f64, f64) {
    let Some(first_light) = lights.first() else {
        return (0.0, 0.0);
    };
    let columns = (first_light.cells.len() + first_light.lamps.len()).max(1);
    let sources = Sources::of(first_light, &options.sky);
    let ranges = ranges(lights, &options.sky);
    let all = lights.iter().flat_map(CellLight::sources);
    let mut theta: Vec<f32> = all.flat_map(|e| e.to_array().map(|v| v.max(1e-5).ln())).collect();
    let (mut first, mut second) = (vec![0.0; theta.len()], vec![0.0; theta.len()]);
    let priors = weighted(options);
    let adam = AdamOptions { beta2: 0.99, ..AdamOptions::default() };
    let (mut start, mut end) = (0.0, 0.0);
    for step in 0..options.steps {
        if step % REFRESH == 0 {
            let light = radiances(&theta);
            for ((glossy, lit), light) in glossy.iter_mut().zip(lit).zip(light.chunks(columns)) {
                glossy.refresh(&lit.shading(light), light, options.sigma);
            }
        }
        let (cost, gradient) =
            cost_and_gradient(&theta, lit, pairs, &sources, glossy, options, &priors);
        if step == 0 {
            start = cost;
        }
        end = cost;
        let t = step as f32 / options.steps as f32;
        let rate = options.rate * (0.5 + 0.5 * (std::f32::consts::PI * t).cos()).max(0.02);
        adam_step(
            &mut theta,
            &gradient,
            &mut first,
            &mut second,
            &[rate],
            u64::from(step) + 1,
            &adam,
        );
        for (value, [least, most]) in theta.iter_mut().zip(&ranges) {
            *value = value.clamp(*least, *most);
        }
    }
    let mut values = radiances(&theta).into_iter();
    for light in lights {
        light.radiance = values.by_ref().take(light.cells.len()).collect();
        for (lamp, radiance) in light.lamps.iter_mut().zip(&mut values) {
            lamp.radiance = radiance;
        }
    }
    (start, end)
}

/// Least and largest logarithm of every source, channels interleaved.
fn ranges(lights: &[CellLight], sky: &SeenSky) -> Vec<[f32; 2]> {
    let of_cell = |cell: &Cell| {
        let [least, most] = sky.range(cell).unwrap_or([-Vec3::INFINITY, Vec3::INFINITY]);
        [0, 1, 2].map(|c| [least[c].max(-LOG_RANGE), most[c].min(LOG_RANGE)])
    };
    let of = |light: &CellLight| -> Vec<[f32; 2]> {
        let seen = light.lamps.iter().flat_map(|lamp| lamp.seen.to_array());
        let of_lamp = |seen: f32| [1.0, MOST_EXCESS].map(|excess| (excess * seen.max(FLOOR)).ln());
        light.cells.iter().flat_map(of_cell).chain(seen.map(of_lamp)).collect()
    };
    lights.iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests;
