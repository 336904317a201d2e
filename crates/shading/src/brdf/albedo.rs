//! Directional albedos of the specular lobe, tabulated once per process.
//!
//! `E(μ, r) = ∫ D V μ_i dw_i` (`F = 1`) and `S(μ, r)`, the same for a dielectric with multiple
//! scattering added. With visible normals sampled uniformly in `u`, `E` is the mean of
//! `G_2 / G_1`, smooth in `u`, so a midpoint rule converges fast. Between nodes both are linear
//! in roughness and in `√μ` (the lobe changes fastest at grazing angles); the averages
//! `2 ∫ E μ dμ` are those of the interpolated function, so that what one coupling takes, the
//! other gives exactly.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use glam::{DVec3, Vec2};

use super::DIELECTRIC_F0;
use super::microfacet::{alpha, cap, masking, schlick, stretched, visibility, visible_normal};

/// Intervals per axis. Measured: the white furnace is within 0.006 of 1 (`tests/furnace.rs`).
const INTERVALS: usize = 32;
const NODES: usize = INTERVALS + 1;
/// Midpoint rule per node; half the azimuths suffice, the lobe is mirror-symmetric.
const AZIMUTHS: usize = 24;
const HEIGHTS: usize = 96;

/// `E` and `S` over (roughness, `√μ`), and their cosine-weighted means over `μ`.
#[derive(Debug)]
pub struct AlbedoTable {
    /// `[roughness][√μ]`: `(E, S)`.
    nodes: Vec<[f64; 2]>,
    averages: Vec<[f64; 2]>,
    nodes_f32: Vec<Vec2>,
}

/// The table of this process; the first call computes it (about 30 ms).
pub fn albedo_table() -> &'static AlbedoTable {
    static TABLE: OnceLock<AlbedoTable> = OnceLock::new();
    TABLE.get_or_init(AlbedoTable::compute)
}

/// `F_ms`: color of the light that left after more than one bounce, `F_avg` the mean Fresnel
/// reflectance; Kulla & Conty 2017 with `F_avg = (20 F_0 + 1) / 21` of Schlick's term.
pub(super) fn multiple_scattering_fresnel(f0: f64, e_avg: f64) -> f64 {
    let f_avg = (20.0 * f0 + 1.0) / 21.0;
    f_avg * f_avg * e_avg / (1.0 - f_avg * (1.0 - e_avg))
}

/// `(∫ D V μ_i, ∫ D V F μ_i)` by a midpoint rule of `azimuths * heights` visible normals.
pub(super) fn single_scattering(
    roughness: f64,
    mu: f64,
    f0: f64,
    azimuths: usize,
    heights: usize,
) -> [f64; 2] {
    let alpha = alpha(roughness);
    let w_o = DVec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
    let stretched = stretched(alpha, w_o);
    let circles: Vec<[f64; 2]> =
        (0..heights).map(|j| cap(stretched, (j as f64 + 0.5) / heights as f64)).collect();
    let masked = masking(alpha, mu);
    let mut sums = [0.0; 2];
    for i in 0..azimuths {
        let phi = TAU * (0.5 * (i as f64 + 0.5) / azimuths as f64);
        let azimuth = [phi.cos(), phi.sin()];
        for circle in &circles {
            let h = visible_normal(alpha, stretched, azimuth, *circle);
            let cos = w_o.dot(h);
            // z of the reflection of the viewer.
            let mu_i = 2.0 * cos * h.z - mu;
            if mu_i > 0.0 {
                let ratio = 4.0 * mu * mu_i * visibility(alpha, mu_i, mu) / masked;
                sums[0] += ratio;
                sums[1] += ratio * schlick(f0, cos);
            }
        }
    }
    sums.map(|s| (s / (azimuths * heights) as f64).min(1.0))
}

impl AlbedoTable {
    fn compute() -> Self {
        let mut nodes = Vec::with_capacity(NODES * NODES);
        let mut averages = Vec::with_capacity(NODES);
        for i in 0..NODES {
            let roughness = i as f64 / INTERVALS as f64;
            let row: Vec<_> = (0..NODES)
                .map(|j| {
                    let mu = (j as f64 / INTERVALS as f64).powi(2).max(1e-5);
                    single_scattering(roughness, mu, DIELECTRIC_F0, AZIMUTHS, HEIGHTS)
                })
                .collect();
            // A mirror's loss is far below rounding; what divides by it must stay finite.
            let e_avg = cosine_mean(row.iter().map(|v| v[0])).min(1.0 - 1e-7);
            let f_ms = multiple_scattering_fresnel(DIELECTRIC_F0, e_avg);
            let row: Vec<_> = row.iter().map(|&[e, f]| [e, f + f_ms * (1.0 - e)]).collect();
            averages.push([e_avg, cosine_mean(row.iter().map(|v| v[1]))]);
            nodes.extend(row);
        }
        let nodes_f32 = nodes.iter().map(|v| Vec2::new(v[0] as f32, v[1] as f32)).collect();
        Self { nodes, averages, nodes_f32 }
    }

    /// `[E, S]` at the cosine `mu` and `roughness`, both in [0, 1].
    pub fn at(&self, mu: f64, roughness: f64) -> [f64; 2] {
        let (i, s) = cell(roughness);
        let (j, t) = cell(mu.sqrt());
        let n = |i: usize, j: usize, k: usize| self.nodes[i * NODES + j][k];
        [0, 1].map(|k| {
            (1.0 - s) * ((1.0 - t) * n(i, j, k) + t * n(i, j + 1, k))
                + s * ((1.0 - t) * n(i + 1, j, k) + t * n(i + 1, j + 1, k))
        })
    }

    /// `[E_avg, S_avg] = 2 ∫ μ [E, S] dμ` at `roughness`.
    pub fn averages(&self, roughness: f64) -> [f64; 2] {
        let (i, s) = cell(roughness);
        [0, 1].map(|k| (1.0 - s) * self.averages[i][k] + s * self.averages[i + 1][k])
    }

    /// The two rows of nodes round a roughness, and the weight of the second.
    #[inline]
    pub(super) fn rows(&self, roughness: f32) -> Rows<'_> {
        let (i, weight) = cell(f64::from(roughness));
        let row = |i: usize| &self.nodes_f32[i * NODES..(i + 1) * NODES];
        Rows { low: row(i), high: row(i + 1), weight: weight as f32 }
    }
}

/// The part of the table that one material reads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows<'a> {
    low: &'a [Vec2],
    high: &'a [Vec2],
    weight: f32,
}

impl Rows<'_> {
    /// `(E, S)` at `mu`.
    #[inline]
    pub(super) fn at(&self, mu: f32) -> Vec2 {
        let x = mu.max(0.0).sqrt() * INTERVALS as f32;
        let j = (x as usize).min(INTERVALS - 1);
        let t = x - j as f32;
        let low = self.low[j] + (self.low[j + 1] - self.low[j]) * t;
        let high = self.high[j] + (self.high[j + 1] - self.high[j]) * t;
        low + (high - low) * self.weight
    }
}

fn cell(x: f64) -> (usize, f64) {
    let x = x.clamp(0.0, 1.0) * INTERVALS as f64;
    let i = (x as usize).min(INTERVALS - 1);
    (i, x - i as f64)
}

/// `2 ∫ v(μ) μ dμ` for `v` linear in `x = √μ` between nodes: `4 ∫ v x³ dx`, exactly.
fn cosine_mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let step = 1.0 / INTERVALS as f64;
    let cell = |(j, pair): (usize, &[f64])| {
        let (x0, x1) = (j as f64 * step, (j + 1) as f64 * step);
        let slope = (pair[1] - pair[0]) / step;
        let offset = pair[0] - slope * x0;
        offset * (x1.powi(4) - x0.powi(4)) + 0.8 * slope * (x1.powi(5) - x0.powi(5))
    };
    values.windows(2).enumerate().map(cell).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_agree_with_a_finer_rule() {
        for (roughness, mu) in
            [(0.0, 1e-5), (0.25, 0.0625), (0.5, 0.015625), (0.75, 1.0), (1.0, 0.25)]
        {
            let fine = single_scattering(roughness, mu, DIELECTRIC_F0, 120, 1000);
            // The first node stands for 0, where the lobe itself is not defined.
            let e = albedo_table().at(if mu < 1e-4 { 0.0 } else { mu }, roughness)[0];
            assert!((e - fine[0]).abs() < 2e-3, "r {roughness} mu {mu}: {e} and {}", fine[0]);
        }
    }

    #[test]
    fn averages_are_those_of_the_interpolated_function() {
        let table = albedo_table();
        for roughness in [0.0, 0.31, 1.0] {
            let n = 200_000;
            let mut sum = [0.0; 2];
            for i in 0..n {
                let mu = (f64::from(i) + 0.5) / f64::from(n);
                let v = table.at(mu, roughness);
                sum = [0, 1].map(|k| sum[k] + 2.0 * mu * v[k] / f64::from(n));
            }
            for (numeric, stored) in sum.iter().zip(table.averages(roughness)) {
                assert!((numeric - stored).abs() < 1e-6, "{numeric} {stored}");
            }
        }
    }

    #[test]
    fn a_smooth_lobe_loses_nothing_and_a_rough_one_much() {
        let table = albedo_table();
        assert!(table.at(1.0, 0.0)[0] > 0.9999);
        // Heitz 2018's and Turquin's figures show 40 to 60 % lost for the roughest lobe.
        let rough = table.averages(1.0)[0];
        assert!((0.35..0.7).contains(&rough), "{rough}");
    }
}
