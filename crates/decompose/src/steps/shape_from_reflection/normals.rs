//! Normals under which a metal mirrors what the photos show.
//!
//! `E(n) = Σ_p mean_k min(|√L_pk - √(F(n·v) M_p(r))|², τ) + λ Σ_p mean_q |n_p - n_q|²`: `L` the radiance that photo `k` shows of
//! point `p`, `M` what the point mirrors along `r = 2 (n·v) n - v`, `F` Schlick's reflectance of the part's color, `q` the
//! points around. Radiances are in units of their mean, and square roots of them are compared, so that the sun does not rule. Minimized by trying normals of neighbors and random turns
//! (Barnes et al. 2009), half of the points at a time; a bounded cost has no gradient to follow where a normal is 30
//! degrees off.

use glam::Vec3;
use motes_math::median::quantile;
use motes_math::rng::keyed_rng;
use rand::RngExt;
use rayon::prelude::*;

use super::mirrored::{Mirrored, Point};

/// `τ`: from here on a photo counts as showing something else.
const MOST_COST: f32 = 0.15;
/// Cost of a normal that faces away from a photo which sees the point.
const AVERTED: f32 = 2.0 * MOST_COST;
/// Least cosine toward a photo that sees the point.
const LEAST_COSINE: f32 = 0.1;
/// Photos from which a point's own evidence counts.
pub(super) const LEAST_PHOTOS: usize = 2;
/// First turn tried, radians, and its share after every sweep.
const TURN: f32 = 0.44;
const COOLING: f32 = 0.92;
const SWEEPS: usize = 30;
/// Sweeps between estimates of the parts' colors.
const RECOLOR: usize = 5;
/// Normals of neighbors that are tried per sweep, and turns.
const BORROWED: usize = 3;
const TURNS: usize = 4;
/// Radiances above this quantile count as this when colors are estimated.
const HIGH: f32 = 0.9;
const STREAM: u64 = 0x6d69_7272;

/// What one photo shows of a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) to_viewer: Vec3,
    /// Square root of the radiance, per channel.
    pub(super) root: Vec3,
    pub(super) light: u32,
}

/// Points of metal with all that is known of them.
pub(super) struct Field<'a> {
    pub(super) seen: &'a [Vec<Seen>],
    pub(super) points: &'a [Point],
    /// What the points mirror, per light.
    pub(super) mirrored: &'a [Mirrored],
    /// Points around every point.
    pub(super) around: &'a [Vec<u32>],
    /// `λ`.
    pub(super) smoothness: f32,
}

/// What was found under one roughness.
#[derive(Clone)]
pub(super) struct Found {
    pub(super) normals: Vec<Vec3>,
    /// Mean cost of the photos per point with evidence, before.
    pub(super) before: f32,
    /// The cost of the photos for every point, after; none without evidence.
    pub(super) costs: Vec<Option<f32>>,
    /// `E` of every part.
    pub(super) energies: Vec<f64>,
}

fn schlick(color: Vec3, cos: f32) -> Vec3 {
    color + (Vec3::ONE - color) * (1.0 - cos.clamp(0.0, 1.0)).powi(5)
}

impl Field<'_> {
    /// The cost of what photos show of point `p` if its normal is `n`; 0 where too few photos see it.
    fn cost(&self, p: usize, n: Vec3, color: Vec3) -> f32 {
        let seen = &self.seen[p];
        if seen.len() < LEAST_PHOTOS {
            return 0.0;
        }
        let of = |s: &Seen| {
            let cos = n.dot(s.to_viewer);
            if !(cos > LEAST_COSINE) {
                return AVERTED;
            }
            let mirrored = self.mirrored[s.light as usize].look_up(p, 2.0 * cos * n - s.to_viewer);
            let sent = (schlick(color, cos) * mirrored).max(Vec3::ZERO);
            let d = s.root - Vec3::new(sent.x.sqrt(), sent.y.sqrt(), sent.z.sqrt());
            d.length_squared().min(MOST_COST)
        };
        seen.iter().map(of).sum::<f32>() / seen.len() as f32
    }

    fn bend(&self, p: usize, n: Vec3, normals: &[Vec3]) -> f32 {
        let around = &self.around[p];
        let sum: f32 = around.iter().map(|&q| (n - normals[q as usize]).length_squared()).sum();
        self.smoothness * sum / around.len().max(1) as f32
    }

    /// Color of every part: what the photos show over what is mirrored, both cut at a high quantile.
    fn colors(&self, normals: &[Vec3], parts: usize) -> Vec<Vec3> {
        let mut pairs: Vec<[[Vec<f32>; 2]; 3]> = vec![Default::default(); parts];
        for (p, seen) in self.seen.iter().enumerate() {
            for s in seen {
                let cos = normals[p].dot(s.to_viewer);
                if !(cos > LEAST_COSINE) {
                    continue;
                }
                let r = 2.0 * cos * normals[p] - s.to_viewer;
                let mirrored = self.mirrored[s.light as usize].look_up(p, r);
                for (c, [shown, sent]) in pairs[self.points[p].part as usize].iter_mut().enumerate()
                {
                    shown.push(s.root[c] * s.root[c]);
                    sent.push(mirrored[c]);
                }
            }
        }
        let cut_sum = |values: &mut Vec<f32>| {
            let high = quantile(values, HIGH).unwrap_or(0.0);
            // Sums from the smallest lose least.
            values.sort_by(f32::total_cmp);
            values.iter().map(|v| v.min(high)).sum::<f32>()
        };
        let of = |[shown, sent]: &mut [Vec<f32>; 2]| {
            (cut_sum(shown) / cut_sum(sent).max(1e-12)).clamp(0.0, 1.0)
        };
        pairs.iter_mut().map(|part| Vec3::from_array([0, 1, 2].map(|c| of(&mut part[c])))).collect()
    }

    /// The normals that cost least, from those of the points.
    pub(super) fn minimize(&self, seed: u64) -> Found {
        let parts = self.points.iter().map(|p| p.part as usize + 1).max().unwrap_or(0);
        let mut normals: Vec<Vec3> = self.points.iter().map(|p| p.normal).collect();
        let mut colors = self.colors(&normals, parts);
        let before = mean(&self.costs(&normals, &colors));
        for sweep in 0..SWEEPS {
            let turn = TURN * COOLING.powi(sweep as i32);
            let step = |p: usize| self.best(p, &normals, &colors, turn, seed, sweep as u64);
            let next = (0..normals.len()).into_par_iter().with_min_len(32).map(step).collect();
            normals = next;
            if sweep % RECOLOR == RECOLOR - 1 {
                colors = self.colors(&normals, parts);
            }
        }
        let costs = self.costs(&normals, &colors);
        let mut energies = vec![0.0; parts];
        for (p, cost) in costs.iter().enumerate() {
            let energy = cost.unwrap_or(0.0) + self.bend(p, normals[p], &normals);
            energies[self.points[p].part as usize] += f64::from(energy);
        }
        Found { normals, before, costs, energies }
    }

    fn best(
        &self,
        p: usize,
        normals: &[Vec3],
        colors: &[Vec3],
        turn: f32,
        seed: u64,
        sweep: u64,
    ) -> Vec3 {
        let mut rng = keyed_rng(seed, STREAM + sweep, p as u64);
        let own = normals[p];
        // Neighbors that move at the same time would chase each other.
        if rng.random::<bool>() {
            return own;
        }
        let around = &self.around[p];
        let sum: Vec3 = around.iter().map(|&q| normals[q as usize]).sum();
        let mean = (sum + own).normalize_or(own);
        let color = colors[self.points[p].part as usize];
        let energy = |n: Vec3| self.cost(p, n, color) + self.bend(p, n, normals);
        let mut best = (energy(own), own);
        let mut attempt = |n: Vec3| {
            let e = energy(n);
            if e < best.0 {
                best = (e, n);
            }
        };
        attempt(mean);
        for _ in 0..BORROWED.min(around.len()) {
            attempt(normals[around[rng.random_range(0..around.len())] as usize]);
        }
        for k in 0..TURNS {
            let from = if k + 1 == TURNS { mean } else { own };
            let aside = Vec3::from_array([0, 1, 2].map(|_| rng.random::<f32>() * 2.0 - 1.0));
            // Uniform in a cube of this half width has about this root mean square along each axis.
            attempt((from + aside * (1.7 * turn)).normalize_or(from));
        }
        best.1
    }

    fn costs(&self, normals: &[Vec3], colors: &[Vec3]) -> Vec<Option<f32>> {
        let of = |p: usize| {
            let told = self.seen[p].len() >= LEAST_PHOTOS;
            told.then(|| self.cost(p, normals[p], colors[self.points[p].part as usize]))
        };
        (0..normals.len()).map(of).collect()
    }
}

/// Mean of what there is; 0 without any.
pub(super) fn mean(costs: &[Option<f32>]) -> f32 {
    let (sum, n) = costs.iter().flatten().fold((0.0, 0.0f32), |(s, n), c| (s + c, n + 1.0));
    sum / n.max(1.0)
}
