//! Relocation and noise: densification as a Markov chain (Kheradmand et al. 2024).
//!
//! Faint Gaussians move onto opaque ones, chosen with a probability that grows with the opacity. The
//! `m` Gaussians that then stand where one stood get the opacity `o' = 1 - (1 - o)^(1/m)` and the
//! scale factor `o / Σ_{i=1}^{m} Σ_{k=0}^{i-1} C(i-1, k) (-1)^k o'^(k+1) / √(k+1)`, with which they
//! render nearly as before. Centers take random steps that are long for faint Gaussians.

use glam::{Mat3, Quat, Vec3};
use motes_math::rng::keyed_rng;
use motes_math::sigmoid::{logit, sigmoid};
use motes_scene::Gaussians;
use rand::{Rng, RngExt};
use rayon::prelude::*;

use super::{RefineCounts, RefineLimits, RefineStats};
use crate::moments::Moments;

const STREAM_RELOCATE: u64 = 5;
const STREAM_NOISE: u64 = 6;
/// Most Gaussians in the place of one.
const MOST_COPIES: usize = 51;
/// Factor of the noise on the learning rate of the centers, and where it fades: opacities above
/// 0.005 hardly move (the paper's values).
const NOISE: f32 = 5e5;
const NOISE_SHARPNESS: f32 = 100.0;
const NOISE_OPACITY: f32 = 0.005;
/// Gaussians per random stream.
const DRAWS: usize = 1024;

/// Opacity and scale factor of each of `copies` Gaussians that stand for one of `opacity`.
fn share(opacity: f64, copies: usize) -> (f64, f64) {
    let new = 1.0 - (1.0 - opacity).powf(1.0 / copies as f64);
    let mut sum = 0.0;
    for i in 1..=copies {
        let mut binomial = 1.0;
        for k in 0..i {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            sum += binomial * sign * new.powi(k as i32 + 1) / ((k + 1) as f64).sqrt();
            binomial *= (i - 1 - k) as f64 / (k + 1) as f64;
        }
    }
    (new, if sum > 0.0 { opacity / sum } else { 1.0 })
}

/// Moves what carries nothing, then adds Gaussians up to the target in the same way.
pub(crate) fn relocate(
    gaussians: &mut Gaussians,
    moments: &mut Moments,
    stats: &mut RefineStats,
    limits: &RefineLimits,
    seed: u64,
    step: u32,
) -> RefineCounts {
    let alive: Vec<u32> =
        (0..gaussians.len() as u32).filter(|&i| limits.keeps(gaussians, i as usize)).collect();
    let pruned = gaussians.len() - alive.len();
    let total = limits.target.max(alive.len());
    let mut cumulative = Vec::with_capacity(alive.len());
    let mut sum = 0.0f64;
    for &i in &alive {
        sum += f64::from(sigmoid(gaussians.opacity_logits[i as usize]));
        cumulative.push(sum);
    }
    let mut rng = keyed_rng(seed, STREAM_RELOCATE, u64::from(step));
    let mut copies = vec![1usize; alive.len()];
    for _ in alive.len()..if alive.is_empty() { 0 } else { total } {
        let share = rng.random::<f64>() * sum;
        let at = cumulative.partition_point(|&c| c <= share);
        copies[at.min(alive.len() - 1)] += 1;
    }
    // A Gaussian whose place is full keeps the most there may be; the count stays below the target.
    let mut rows = alive.clone();
    for (&i, copies) in alive.iter().zip(&mut copies) {
        *copies = (*copies).min(MOST_COPIES);
        rows.extend(std::iter::repeat_n(i, *copies - 1));
    }
    let sh_row = 3 * gaussians.sh_coefficients();
    let mut fresh = vec![true; rows.len()];
    for (fresh, &copies) in fresh.iter_mut().zip(&copies) {
        *fresh = copies > 1;
    }
    gaussians.gather(&rows);
    moments.gather(&rows, &fresh, sh_row);
    let added = rows.len() - alive.len();
    let mut next = alive.len();
    for (i, &copies) in copies.iter().enumerate().filter(|(_, c)| **c > 1) {
        let opacity = f64::from(sigmoid(gaussians.opacity_logits[i]));
        let (opacity, factor) = share(opacity.min(1.0 - 1e-7), copies);
        for row in std::iter::once(i).chain(next..next + copies - 1) {
            gaussians.opacity_logits[row] = logit(opacity.max(1e-6) as f32);
            for s in &mut gaussians.log_scales[row] {
                *s += factor.ln() as f32;
            }
        }
        next += copies - 1;
    }
    *stats = RefineStats::zeros(gaussians.len());
    RefineCounts { pruned, divided: added }
}

/// Moves centers at random within their own shape, `rate` being their learning rate.
pub(crate) fn add_noise(gaussians: &mut Gaussians, rate: f32, seed: u64, step: u32) {
    let Gaussians { means, rotations, log_scales, opacity_logits, .. } = gaussians;
    let (rotations, log_scales, opacity_logits) = (&*rotations, &*log_scales, &*opacity_logits);
    means.par_chunks_mut(DRAWS).enumerate().for_each(|(chunk, means)| {
        let mut rng = keyed_rng(seed, STREAM_NOISE, u64::from(step) << 32 | chunk as u64);
        for (k, mean) in means.iter_mut().enumerate() {
            let i = chunk * DRAWS + k;
            let normal = normals(&mut rng);
            let opacity = sigmoid(opacity_logits[i]);
            let gate = sigmoid(NOISE_SHARPNESS * (NOISE_OPACITY - opacity));
            let [w, x, y, z] = rotations[i];
            let axes = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
            let variance = (Vec3::from(log_scales[i]) * 2.0).exp();
            let moved = axes * (variance * (axes.transpose() * normal)) * (gate * rate * NOISE);
            if moved.is_finite() {
                *mean = (Vec3::from(*mean) + moved).to_array();
            }
        }
    });
}

/// Three normal numbers (Box and Muller 1958).
fn normals(rng: &mut impl Rng) -> Vec3 {
    let mut pair = || {
        let radius = (-2.0 * (1.0 - rng.random::<f32>()).ln()).sqrt();
        let (sin, cos) = (std::f32::consts::TAU * rng.random::<f32>()).sin_cos();
        [radius * cos, radius * sin]
    };
    let ([x, y], [z, _]) = (pair(), pair());
    Vec3::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use motes_testkit::random_gaussians;

    use super::*;

    const LIMITS: RefineLimits =
        RefineLimits { target: 60, prune_opacity: 0.005, max_scale: 10.0, min_pull: 0.0 };

    #[test]
    fn copies_cover_the_middle_as_one_did() {
        for copies in 1..6usize {
            for opacity in [0.05, 0.5, 0.95] {
                let (new, factor) = share(opacity, copies);
                assert!((1.0 - (1.0 - new).powi(copies as i32) - opacity).abs() < 1e-9);
                assert!(factor > 0.5 && factor <= 1.0 + 1e-9, "{copies} {opacity}: {factor}");
                // Light absorbed along a line through the middle, against the original's o √(2π).
                let line = |f: &dyn Fn(f64) -> f64| -> f64 {
                    (-800..800).map(|i| f(f64::from(i) * 0.01) * 0.01).sum()
                };
                let bell = |x: f64, s: f64| (-0.5 * (x / s).powi(2)).exp();
                let before = line(&|x| opacity * bell(x, 1.0));
                let after = line(&|x| 1.0 - (1.0 - new * bell(x, factor)).powi(copies as i32));
                assert!((before - after).abs() < 1e-3 * before, "{copies} {opacity}");
            }
        }
    }

    #[test]
    fn faint_ones_move_onto_opaque_ones_and_the_count_meets_the_target() {
        let mut g = random_gaussians(1, 50, 1);
        g.opacity_logits = vec![-20.0; 50];
        g.opacity_logits[7] = 2.0;
        g.opacity_logits[9] = 2.0;
        let places = [g.means[7], g.means[9]];
        let mut moments = Moments::zeros(&g);
        let mut stats = RefineStats::zeros(50);
        let counts = relocate(&mut g, &mut moments, &mut stats, &LIMITS, 3, 10);
        assert_eq!((counts.pruned, counts.divided, g.len()), (48, 58, 60));
        assert!(g.means.iter().all(|mean| places.contains(mean)));
        assert!(g.is_consistent() && g.invalid_rows().is_empty());
        assert_eq!((stats.pull.len(), moments.first.sh.len()), (60, g.sh.len()));
        // Nothing left: nothing to copy.
        g.opacity_logits.fill(-20.0);
        relocate(&mut g, &mut moments, &mut stats, &LIMITS, 3, 20);
        assert!(g.is_empty());
    }

    #[test]
    fn places_are_chosen_as_often_as_they_are_opaque() {
        // Twenty thousand copies of a hundred Gaussians of two opacities, chi-square with 99.
        let mut g = random_gaussians(1, 1_100, 0);
        g.opacity_logits.fill(-20.0);
        let opacity = |i: usize| if i < 50 { 0.2f32 } else { 0.6 };
        g.opacity_logits[..100].iter_mut().enumerate().for_each(|(i, o)| *o = logit(opacity(i)));
        let places: Vec<[f32; 3]> = g.means[..100].to_vec();
        let limits = RefineLimits { target: 1_100, ..LIMITS };
        let mut counts = vec![0.0f64; 100];
        for step in 0..20 {
            let mut g = g.clone();
            let (mut moments, mut stats) = (Moments::zeros(&g), RefineStats::zeros(g.len()));
            relocate(&mut g, &mut moments, &mut stats, &limits, 11, step);
            for mean in &g.means[100..] {
                counts[places.iter().position(|p| p == mean).expect("a place")] += 1.0;
            }
        }
        let total: f64 = counts.iter().sum();
        let all: f64 = (0..100).map(|i| f64::from(opacity(i))).sum();
        let chi2: f64 = (0..100)
            .map(|i| {
                let expected = total * f64::from(opacity(i)) / all;
                (counts[i] - expected).powi(2) / expected
            })
            .sum();
        assert!(chi2 < 148.2, "{chi2}, beyond the 0.1 % point");
    }

    #[test]
    fn noise_moves_faint_gaussians_only_and_is_normal() {
        let n = 20_000;
        let mut g = random_gaussians(1, n, 0);
        g.rotations.fill([1.0, 0.0, 0.0, 0.0]);
        g.log_scales.fill([0.0, -1.0, -2.0]);
        g.opacity_logits = (0..n).map(|i| if i % 2 == 0 { -20.0 } else { 3.0 }).collect();
        g.means.fill([0.0; 3]);
        add_noise(&mut g, 1.0 / NOISE, 1, 1);
        let gate = f64::from(sigmoid(NOISE_SHARPNESS * NOISE_OPACITY));
        let faint: Vec<[f32; 3]> = g.means.iter().copied().step_by(2).collect();
        assert!(g.means.iter().skip(1).step_by(2).all(|m| m[0].abs() < 1e-6));
        for (axis, variance) in [1.0, (-2.0f64).exp(), (-4.0f64).exp()].into_iter().enumerate() {
            let deviation = gate * variance;
            // Counts in four equally likely bins of the normal distribution, chi-square with 3.
            let mut bins = [0.0f64; 4];
            for mean in &faint {
                let z = f64::from(mean[axis]) / deviation;
                let bin = [-0.674_49, 0.0, 0.674_49].iter().filter(|&&edge| z > edge).count();
                bins[bin] += 1.0;
            }
            let expected = faint.len() as f64 / 4.0;
            let chi2: f64 = bins.iter().map(|b| (b - expected).powi(2) / expected).sum();
            assert!(chi2 < 16.3, "axis {axis}: {bins:?}, beyond the 0.1 % point");
        }
    }
}
