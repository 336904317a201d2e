//! Least squares without a matrix (Hestenes & Stiefel 1952).

use std::ops::{Add, Div, Mul, Sub};

use glam::Vec3;
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
    let mut u = vec![T::default(); b.len()];
    let mut residual = b;
    let mut direction = residual.clone();
    let mut norm = dot(&residual, &residual);
    let enough = norm * ENOUGH;
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
