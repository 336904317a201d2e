//! Least squares without a matrix (Hestenes & Stiefel 1952).

use std::ops::{Add, Div, Mul, Sub};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Values per parallel chunk.
const CHUNK: usize = 4096;
/// The residual is small enough at this share of its first square.
const ENOUGH: f64 = 1e-8;

/// What is solved for at every vertex: a number or a vector.
pub(crate) trait Value:
    Copy
    + Default
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<f32, Output = Self>
    + Div<f32, Output = Self>
{
    fn product(self, other: Self) -> f64;
}

impl Value for f32 {
    fn product(self, other: Self) -> f64 {
        f64::from(self) * f64::from(other)
    }
}

impl Value for Vec2 {
    fn product(self, other: Self) -> f64 {
        f64::from(self.dot(other))
    }
}

impl Value for Vec3 {
    fn product(self, other: Self) -> f64 {
        f64::from(self.dot(other))
    }
}

/// `u` with `A u = b` after at most `iterations`, from 0; `A` symmetric and not negative. The result does not depend on the number of
/// threads.
pub(crate) fn solve<T: Value>(
    b: Vec<T>,
    apply: impl Fn(&[T]) -> Vec<T>,
    iterations: usize,
) -> Vec<T> {
    let enough = dot(&b, &b) * ENOUGH;
    improved(vec![T::default(); b.len()], b, apply, iterations, enough)
}

/// The same with the diagonal of `A`, about: what is stiff here and soft there takes a fraction of the iterations (Jacobi's preconditioner).
pub(crate) fn solve_scaled(
    b: Vec<f32>,
    diagonal: &[f32],
    apply: impl Fn(&[f32]) -> Vec<f32>,
    iterations: usize,
) -> Vec<f32> {
    let scale: Vec<f32> =
        diagonal.iter().map(|d| if *d > 0.0 { d.sqrt().recip() } else { 0.0 }).collect();
    let scaled = |values: &[f32]| -> Vec<f32> {
        values.par_iter().zip(&scale).with_min_len(CHUNK).map(|(v, s)| v * s).collect()
    };
    scaled(&solve(scaled(&b), |u| scaled(&apply(&scaled(u))), iterations))
}

/// The same from a `start` that is near: systems that differ little are solved one after the other.
pub(crate) fn solve_from<T: Value>(
    start: Vec<T>,
    b: Vec<T>,
    apply: impl Fn(&[T]) -> Vec<T>,
    iterations: usize,
) -> Vec<T> {
    let enough = dot(&b, &b) * ENOUGH;
    let image = apply(&start);
    let residual = b.into_par_iter().zip(image).map(|(b, i)| b - i).collect();
    improved(start, residual, apply, iterations, enough)
}

/// Moves `u` until the square of the residual, now `residual`, is at most `enough`.
fn improved<T: Value>(
    mut u: Vec<T>,
    mut residual: Vec<T>,
    apply: impl Fn(&[T]) -> Vec<T>,
    iterations: usize,
    enough: f64,
) -> Vec<T> {
    let mut direction = residual.clone();
    let mut norm = dot(&residual, &residual);
    for _ in 0..iterations {
        if !(norm > enough) {
            break;
        }
        let image = apply(&direction);
        let curvature = dot(&direction, &image);
        if !(curvature > 0.0) {
            break;
        }
        let step = (norm / curvature) as f32;
        u.par_iter_mut().zip(&direction).for_each(|(u, d)| *u = *u + *d * step);
        residual.par_iter_mut().zip(&image).for_each(|(r, i)| *r = *r - *i * step);
        let next = dot(&residual, &residual);
        let keep = (next / norm) as f32;
        direction.par_iter_mut().zip(&residual).for_each(|(d, r)| *d = *r + *d * keep);
        norm = next;
    }
    u
}

/// In chunks of fixed size: the same at any number of threads.
fn dot<T: Value>(a: &[T], b: &[T]) -> f64 {
    let parts: Vec<f64> = a
        .par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.product(*b)).sum())
        .collect();
    parts.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of springs, each end held a little.
    fn chain(u: &[f32]) -> Vec<f32> {
        let at = |i: usize| u.get(i).copied().unwrap_or(0.0);
        (0..u.len()).map(|i| 2.1 * u[i] - at(i + 1) - at(i.wrapping_sub(1))).collect()
    }

    /// The same with masses over nine powers of ten.
    fn stiff_and_soft(u: &[f32]) -> Vec<f32> {
        chain(u).iter().enumerate().map(|(i, v)| v + u[i] * 10f32.powi(i as i32 % 10 - 4)).collect()
    }

    #[test]
    fn scaled_by_its_diagonal_a_system_takes_a_fraction_of_the_iterations() {
        let truth: Vec<f32> = (0..200).map(|i| (i as f32 * 0.3).sin()).collect();
        let b = stiff_and_soft(&truth);
        let diagonal: Vec<f32> =
            (0..200).map(|i| if i == 7 { 0.0 } else { 2.1 + 10f32.powi(i % 10 - 4) }).collect();
        let error = |u: &[f32]| {
            let apart = |i: usize| if i == 7 { 0.0 } else { (u[i] - truth[i]).abs() };
            (20..200).map(apart).fold(0.0, f32::max)
        };
        let plain = error(&solve(b.clone(), stiff_and_soft, 25));
        let scaled = solve_scaled(b, &diagonal, stiff_and_soft, 25);
        assert!(error(&scaled) < 0.02 * plain, "{} {plain}", error(&scaled));
        // What has no stiffness stays.
        assert_eq!(scaled[7], 0.0);
    }

    #[test]
    fn a_system_is_solved_from_anywhere_and_sooner_from_nearby() {
        let truth: Vec<f32> = (0..200).map(|i| (i as f32 * 0.3).sin()).collect();
        let b = chain(&truth);
        let error =
            |u: &[f32]| u.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(error(&solve(b.clone(), chain, 300)) < 1e-3);
        let far = vec![3.0; 200];
        assert!(error(&solve_from(far, b.clone(), chain, 300)) < 1e-3);
        let near: Vec<f32> = truth.iter().map(|v| v + 0.01).collect();
        let few = 8;
        let (cold, warm) = (solve(b.clone(), chain, few), solve_from(near, b.clone(), chain, few));
        assert!(error(&warm) < 0.1 * error(&cold), "{} {}", error(&warm), error(&cold));
        // A solution stays bit for bit, and nothing is divided by nothing.
        assert_eq!(solve_from(vec![0.0; 3], vec![0.0; 3], chain, 5), [0.0; 3]);
    }
}
