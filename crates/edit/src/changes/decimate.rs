//! Fewer Gaussians by merging neighbors.
//!
//! A Gaussian carries the mass `m = -ln(1 - o) A`: the optical depth of its peak, because depths add where layers overlap, times
//! its mean projected area, that of an ellipsoid with its radii, `A = (s1 s2 + s2 s3 + s3 s1) / 3` up to a constant.
//! Two become one with the moments of their mixture:
//!
//! ```text
//! μ = Σ m_i μ_i / m,   Σ = Σ m_i (Σ_i + (μ_i - μ)(μ_i - μ)ᵀ) / m,   o = 1 - exp(-m / A(Σ))
//! ```
//!
//! and colors, float columns and bands weighted by mass. In rounds, the pairs of near neighbors with the least cost merge, each
//! Gaussian once per round; the cost is the mass that moves, times how far it moves in radii and in color.

use std::num::NonZero;

use glam::{DMat3, DQuat, DVec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_math::sigmoid::logit;
use motes_scene::{ColumnValues, Gaussians};
use rayon::prelude::*;

use crate::EditState;
use crate::mass::{MOST_OPAQUE, optical_depth, projected_area};
use crate::symmetric::eigen;

/// Neighbors that a Gaussian may merge with.
const NEIGHBORS: usize = 6;
/// Share of the Gaussians that merge in one round: more would take bad pairs before better ones arise.
const SHARE_PER_ROUND: f64 = 0.25;
/// Weight of a squared difference of color against a squared distance in radii: a step of 0.3 in band 0
/// counts like one radius.
const COLOR_WEIGHT: f64 = 11.0;

/// Merges the Gaussians of `rows` until `count` of them are left; returns how many are.
///
/// Gaussians without finite values are not touched and count as left.
pub fn decimate(state: &mut EditState, rows: &[u32], count: usize) -> usize {
    let mut active: Vec<u32> = {
        let invalid = state.gaussians.invalid_rows();
        rows.iter().copied().filter(|row| invalid.binary_search(row).is_err()).collect()
    };
    let mut left = rows.len();
    let mut gone = vec![false; state.len()];
    while left > count && active.len() > 1 {
        let most = ((active.len() as f64 * SHARE_PER_ROUND) as usize).max(1).min(left - count);
        let pairs = best_pairs(&state.gaussians, &active, most);
        if pairs.is_empty() {
            break;
        }
        for (a, b) in &pairs {
            merge(&mut state.gaussians, *a as usize, *b as usize);
            state.note_merged(*b, *a);
            state.material_changed[*a as usize] |= state.material_changed[*b as usize];
            gone[*b as usize] = true;
        }
        left -= pairs.len();
        active.retain(|row| !gone[*row as usize]);
    }
    let kept: Vec<u32> = (0..state.len() as u32).filter(|row| !gone[*row as usize]).collect();
    state.gather(&kept);
    left
}

/// At most `most` pairs `(heavier, lighter)`, the cheapest first, no row twice.
fn best_pairs(gaussians: &Gaussians, active: &[u32], most: usize) -> Vec<(u32, u32)> {
    let points: Vec<[f32; 3]> = active.iter().map(|r| gaussians.means[*r as usize]).collect();
    let Ok(tree) = ImmutableKdTree::<f32, 3>::new_from_slice(&points) else { return Vec::new() };
    let wanted = NonZero::new(NEIGHBORS + 1).unwrap_or(NonZero::<usize>::MIN);
    let parts: Vec<Part> = active.iter().map(|r| Part::of(gaussians, *r as usize)).collect();
    let mut candidates: Vec<(f64, u32, u32)> = points
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, point)| {
            let found = tree.query(point).nearest_n::<SquaredEuclidean<f32>>(wanted).execute();
            let parts = &parts;
            let costs = found.into_iter().filter_map(move |near| {
                let k = near.item as usize;
                let (a, b) = (i.min(k), i.max(k));
                let cost = parts[a].cost(&parts[b]);
                (k != i && cost.is_finite()).then_some((cost, a as u32, b as u32))
            });
            costs.collect::<Vec<_>>()
        })
        .collect();
    candidates.par_sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut used = vec![false; active.len()];
    let mut pairs = Vec::new();
    for (_, a, b) in candidates {
        if pairs.len() == most {
            break;
        }
        if !used[a as usize] && !used[b as usize] {
            used[a as usize] = true;
            used[b as usize] = true;
            let heavier_first = parts[a as usize].mass >= parts[b as usize].mass;
            let (x, y) = (active[a as usize], active[b as usize]);
            pairs.push(if heavier_first { (x, y) } else { (y, x) });
        }
    }
    pairs
}

/// What the cost of a merge depends on.
struct Part {
    mean: DVec3,
    mass: f64,
    /// Sum of the squared radii.
    spread: f64,
    color: DVec3,
}

impl Part {
    fn of(gaussians: &Gaussians, row: usize) -> Self {
        let scales = DVec3::from_array(gaussians.log_scales[row].map(|s| f64::from(s).exp()));
        let sh = gaussians.sh_of(row);
        Self {
            mean: DVec3::from_array(gaussians.means[row].map(f64::from)),
            mass: optical_depth(gaussians.opacity_logits[row]) * projected_area(scales),
            spread: scales.length_squared(),
            color: DVec3::new(sh[0].into(), sh[1].into(), sh[2].into()),
        }
    }

    fn cost(&self, other: &Self) -> f64 {
        let mass = self.mass * other.mass / (self.mass + other.mass).max(f64::MIN_POSITIVE);
        let moved = self.mean.distance_squared(other.mean)
            / (self.spread + other.spread).max(f64::MIN_POSITIVE);
        mass * (moved + COLOR_WEIGHT * 0.0796 * self.color.distance_squared(other.color))
    }
}

fn covariance(gaussians: &Gaussians, row: usize) -> (DMat3, DVec3) {
    let [w, x, y, z] = gaussians.rotations[row].map(f64::from);
    let rotation = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
    let scales = DVec3::from_array(gaussians.log_scales[row].map(|s| f64::from(s).exp()));
    (rotation * DMat3::from_diagonal(scales * scales) * rotation.transpose(), scales)
}

/// Puts the mixture of rows `a` and `b` into row `a`.
fn merge(gaussians: &mut Gaussians, a: usize, b: usize) {
    let [(cov_a, s_a), (cov_b, s_b)] = [a, b].map(|row| covariance(gaussians, row));
    let mass = |row: usize, s| optical_depth(gaussians.opacity_logits[row]) * projected_area(s);
    let (m_a, m_b) = (mass(a, s_a).max(f64::MIN_POSITIVE), mass(b, s_b));
    let share = m_b / (m_a + m_b);
    let [p, q] = [a, b].map(|row| DVec3::from_array(gaussians.means[row].map(f64::from)));
    let d = q - p;
    let mean = p + d * share;
    let outer = DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    let cov = cov_a * (1.0 - share) + cov_b * share + outer * (share * (1.0 - share));
    let (rotation, variances) = eigen(cov);
    let scales = variances.max(DVec3::splat(1e-30)).to_array().map(f64::sqrt);
    let depth = (m_a + m_b) / projected_area(DVec3::from_array(scales)).max(f64::MIN_POSITIVE);
    gaussians.means[a] = mean.as_vec3().to_array();
    let q = rotation;
    gaussians.rotations[a] = [q.w, q.x, q.y, q.z].map(|v| v as f32);
    gaussians.log_scales[a] = scales.map(|s| s.ln() as f32);
    gaussians.opacity_logits[a] = logit((1.0 - (-depth).exp()).min(MOST_OPAQUE) as f32);
    let stride = 3 * gaussians.sh_coefficients();
    for k in 0..stride {
        let (x, y) = (gaussians.sh[a * stride + k], gaussians.sh[b * stride + k]);
        gaussians.sh[a * stride + k] = x + (y - x) * share as f32;
    }
    for column in &mut gaussians.extra {
        if let ColumnValues::F32(values) = &mut column.values {
            values[a] += (values[b] - values[a]) * share as f32;
        }
    }
    unit_normal(gaussians, a);
}

/// Means of normals are too short.
fn unit_normal(gaussians: &mut Gaussians, row: usize) {
    let mut normal = [None; 3];
    for (slot, name) in normal.iter_mut().zip(["nx", "ny", "nz"]) {
        *slot = gaussians.extra.iter().position(|c| c.name == name);
    }
    let [Some(x), Some(y), Some(z)] = normal else { return };
    let at = |i: usize| match &gaussians.extra[i].values {
        ColumnValues::F32(values) => values[row],
        _ => 0.0,
    };
    let n = glam::Vec3::new(at(x), at(y), at(z)).normalize_or_zero();
    for (i, value) in [x, y, z].into_iter().zip(n.to_array()) {
        if let ColumnValues::F32(values) = &mut gaussians.extra[i].values {
            values[row] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_that_lie_together_keep_their_moments() {
        let mut gaussians = motes_testkit::random_gaussians(3, 2, 1);
        gaussians.opacity_logits = vec![-1.0, -2.0];
        let parts: Vec<Part> = (0..2).map(|i| Part::of(&gaussians, i)).collect();
        let mass: f64 = parts.iter().map(|p| p.mass).sum();
        let mean = parts.iter().map(|p| p.mean * p.mass).sum::<DVec3>() / mass;
        let second = |g: &Gaussians, row: usize| {
            let p = DVec3::from_array(g.means[row].map(f64::from)) - mean;
            covariance(g, row).0 + DMat3::from_cols(p * p.x, p * p.y, p * p.z)
        };
        let mixture = (second(&gaussians, 0) * parts[0].mass
            + second(&gaussians, 1) * parts[1].mass)
            * (1.0 / mass);
        merge(&mut gaussians, 0, 1);
        let merged = Part::of(&gaussians, 0);
        assert!((merged.mean - mean).length() < 1e-6);
        assert!((merged.mass - mass).abs() < 1e-4 * mass, "{} {mass}", merged.mass);
        let error = (second(&gaussians, 0) - mixture).to_cols_array();
        assert!(error.iter().all(|e| e.abs() < 1e-6), "{error:?}");
    }

    #[test]
    fn the_inside_of_a_dense_sheet_looks_the_same_with_a_third() {
        use motes_raster::{RenderOptions, render};
        use motes_scene::{Pinhole, Pose};
        let n = 60;
        let mut gaussians = motes_testkit::random_gaussians(3, n * n, 0);
        for i in 0..n * n {
            let (x, y) = ((i % n) as f32 / n as f32 - 0.5, (i / n) as f32 / n as f32 - 0.5);
            gaussians.means[i] = [x, y, 0.0];
            gaussians.rotations[i] = [1.0, 0.0, 0.0, 0.0];
            gaussians.log_scales[i] = [-4.3, -4.3, -7.0];
            gaussians.opacity_logits[i] = 1.0;
            let smooth = [(4.0 * x).sin(), (3.0 * y).cos(), x * y];
            gaussians.sh[3 * i..3 * i + 3].copy_from_slice(&smooth);
        }
        let camera = Pinhole { fx: 64.0, fy: 64.0, cx: 32.0, cy: 32.0, width: 64, height: 64 };
        let pose = Pose::look_at(DVec3::Z * 0.7, DVec3::ZERO, DVec3::Y).unwrap();
        let show = |g: &Gaussians| render(g, &camera, &pose, &RenderOptions::default()).color.data;
        let before = show(&gaussians);
        let psnr = |after: &Gaussians| {
            let squares = before.iter().zip(show(after)).map(|(a, b)| f64::from(a - b).powi(2));
            -10.0 * (squares.sum::<f64>() / before.len() as f64).log10()
        };
        let mut dropped = gaussians.clone();
        dropped.gather(&(0..n as u32 * n as u32).step_by(3).collect::<Vec<_>>());
        let mut state = EditState::new("t", gaussians, None, None, DVec3::Z);
        let rows: Vec<u32> = (0..(n * n) as u32).collect();
        assert_eq!(decimate(&mut state, &rows, 1200), 1200);
        assert_eq!(state.len(), 1200);
        let (merged, dropped) = (psnr(&state.gaussians), psnr(&dropped));
        assert!(merged > dropped + 10.0 && merged > 25.0, "{merged} dB, {dropped} dB when dropped");
    }

    #[test]
    fn only_the_rows_asked_for_are_merged() {
        let gaussians = motes_testkit::random_gaussians(3, 100, 1);
        let last = gaussians.means[99];
        let mut state = EditState::new("t", gaussians, None, None, DVec3::Z);
        let rows: Vec<u32> = (0..50).collect();
        assert_eq!(decimate(&mut state, &rows, 10), 10);
        assert_eq!((state.len(), state.gaussians.means[59]), (60, last));
        assert_eq!(decimate(&mut state, &[3], 1), 1);
    }
}
