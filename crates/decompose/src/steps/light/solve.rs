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
use super::priors::{CellSum, LIGHT_PRIORS, LightPrior, Lighting, PointSum, Slopes};
use super::transport::Transport;
use crate::illumination::CellLight;

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

/// Cost and gradient by `θ`, channels interleaved, one light after the other; the last `lamps` columns of each are lamps.
#[expect(clippy::too_many_arguments, reason = "each is another part of the cost")]
pub(crate) fn cost_and_gradient(
    theta: &[f32],
    lit: &[LitPoints],
    pairs: &[Pair],
    neighbors: &[(u32, u32)],
    lamps: usize,
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
    let log_base: Vec<Vec3> = radiance
        .iter()
        .zip(&shading)
        .map(|(l, s)| l.max(Vec3::splat(FLOOR)).ln() - s.ln())
        .collect();

    let lighting = Lighting {
        theta,
        lights: lit.len(),
        lamps,
        neighbors,
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

/// Cost of pairs whose base colors differ, added to `cost`, and its slope by every logarithm.
fn likeness(log_base: &[Vec3], pairs: &[Pair], sigma: f32, cost: &mut f64) -> Vec<Vec3> {
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
    let lamps = first_light.lamps.len();
    let columns = (first_light.cells.len() + lamps).max(1);
    let neighbors = first_light.neighbors();
    let ranges = ranges(lights);
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
            cost_and_gradient(&theta, lit, pairs, &neighbors, lamps, glossy, options, &priors);
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
fn ranges(lights: &[CellLight]) -> Vec<[f32; 2]> {
    let of = |light: &CellLight| -> Vec<[f32; 2]> {
        let seen = light.lamps.iter().flat_map(|lamp| lamp.seen.to_array());
        let of_lamp = |seen: f32| [1.0, MOST_EXCESS].map(|excess| (excess * seen.max(FLOOR)).ln());
        let of_cells = vec![[-LOG_RANGE, LOG_RANGE]; 3 * light.cells.len()];
        of_cells.into_iter().chain(seen.map(of_lamp)).collect()
    };
    lights.iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::super::glossy::{GlossyPoint, GlossyView};
    use super::*;

    const NEIGHBORS: [(u32, u32); 5] = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0)];

    fn noise(i: usize) -> f32 {
        (i as f32 * 12.9898).sin() * 0.5 + 0.5
    }

    /// Seven points under each of two lights of five cells.
    fn lit_points() -> Vec<LitPoints> {
        let (points, columns) = (7, 5);
        [0, 500]
            .into_iter()
            .map(|k| LitPoints {
                transport: Transport {
                    cells: (0..points * columns).map(|i| 0.02 + 0.2 * noise(k + i)).collect(),
                    bounce: (0..points).map(|i| Vec3::splat(0.05 * noise(k + 90 + i))).collect(),
                    columns,
                },
                radiance: (0..points)
                    .map(|i| {
                        Vec3::new(
                            0.1 + noise(k + i),
                            0.2 + noise(k + i + 30),
                            0.3 + noise(k + i + 60),
                        )
                    })
                    .collect(),
            })
            .collect()
    }

    fn options() -> SolveOptions {
        SolveOptions {
            smooth: 0.3,
            white: 0.2,
            scale: 0.5,
            glossy: 1.0,
            color: 0.7,
            typical_base_color: 0.3,
            sigma: 0.2,
            steps: 1,
            rate: 0.1,
            others: vec![("even-light", 0.4)],
        }
    }

    /// Compares a gradient with difference quotients of its cost.
    fn check(at: impl Fn(&[f32]) -> (f64, Vec<f32>)) -> Result<(), String> {
        let theta: Vec<f32> = (0..30).map(|i| noise(i + 200) - 0.4).collect();
        let (_, gradient) = at(&theta);
        let mut largest = 0.0f64;
        for i in 0..theta.len() {
            let moved = |d: f32| {
                let mut t = theta.clone();
                t[i] += d;
                at(&t).0
            };
            let step = 5e-3;
            let numeric = (moved(step) - moved(-step)) / (2.0 * f64::from(step));
            let analytic = f64::from(gradient[i]);
            largest = largest.max(numeric.abs());
            if (numeric - analytic).abs() >= 2e-3 * analytic.abs() + 2e-5 {
                return Err(format!("{i}: {numeric} {analytic}"));
            }
        }
        if largest > 1e-3 { Ok(()) } else { Err("it has no slope".into()) }
    }

    #[test]
    fn the_gradient_of_every_prior_is_that_of_its_cost() {
        let (lit, options) = (lit_points(), options());
        for prior in LIGHT_PRIORS {
            let at = |theta: &[f32]| {
                cost_and_gradient(theta, &lit, &[], &NEIGHBORS, 1, &[], &options, &[(*prior, 0.7)])
            };
            check(at).unwrap_or_else(|error| panic!("{}: {error}", prior.name()));
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_cost() {
        let (points, columns) = (7, 5);
        let (lit, options) = (lit_points(), options());
        let pairs: Vec<Pair> = (0..30)
            .map(|i| Pair {
                a: (i % 14) as u32,
                b: ((i * 3 + 1) % 14) as u32,
                weight: 0.2 + noise(i),
            })
            .collect();
        // A point of each kind under each light, seen three times.
        let glossy: Vec<Glossy> = [0, 700]
            .into_iter()
            .map(|k| {
                let view = |p: usize, v: usize| GlossyView {
                    lobe: (0..3)
                        .map(|j| {
                            let cell = (p + v + 2 * j) % columns;
                            (cell as u32, Vec3::new(0.2, 0.3, 0.4) * noise(k + 7 * p + 3 * v + j))
                        })
                        .collect(),
                    bounce: Vec3::splat(0.1 * noise(k + p + v)),
                    radiance: Vec3::splat(0.2 + noise(k + 50 + 5 * p + v)),
                    weight: 0.1 + 0.1 * noise(k + v),
                };
                let point = |p: usize| GlossyPoint {
                    row: (2 * p + 1) as u32,
                    is_dielectric: p != 1,
                    unit: 0.3 + noise(k + p),
                    views: (0..3).map(|v| view(p, v)).collect(),
                };
                Glossy::new((0..3).map(point).collect(), &vec![Vec3::new(0.3, 0.5, 0.7); points])
            })
            .collect();
        let priors = weighted(&options);
        let at = |theta: &[f32]| {
            cost_and_gradient(theta, &lit, &pairs, &NEIGHBORS, 1, &glossy, &options, &priors)
        };
        check(at).unwrap();
    }
}
