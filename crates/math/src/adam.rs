//! Adam (Kingma and Ba 2015).

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

/// Decay rates and the guard of the division.
#[derive(Clone, Copy, Debug)]
pub struct AdamOptions {
    /// Decay of the first moment.
    pub beta1: f32,
    /// Decay of the second moment.
    pub beta2: f32,
    /// Added to the root of the second moment.
    pub epsilon: f32,
    /// Leaves values with a gradient of exactly 0 alone, moments included.
    pub sparse: bool,
}

impl Default for AdamOptions {
    /// 0.9, 0.999, 1e-15: gradients of a mean over all pixels are tiny, so the customary 1e-8
    /// would swallow them (Kerbl et al. 2023).
    fn default() -> Self {
        Self { beta1: 0.9, beta2: 0.999, epsilon: 1e-15, sparse: false }
    }
}

/// One step on `values`: `m = β1 m + (1-β1) g`, `v = β2 v + (1-β2) g²`,
/// `x -= rate · m̂ / (√v̂ + ε)` with `m̂ = m / (1-β1^t)`, `v̂ = v / (1-β2^t)`.
///
/// `rates` repeats along the values: value `i` uses `rates[i % rates.len()]`. `step` counts from 1.
/// A non-finite gradient leaves its value and moments alone.
///
/// # Panics
/// When the lengths differ or `rates` is empty.
pub fn adam_step(
    values: &mut [f32],
    gradients: &[f32],
    first: &mut [f32],
    second: &mut [f32],
    rates: &[f32],
    step: u64,
    options: &AdamOptions,
) {
    assert!(!rates.is_empty(), "at least one learning rate");
    let count = values.len();
    let slices = Slices { values, gradients, first, second };
    slices.check(count);
    let k = Constants::new(step, options);
    // The pattern of rates, repeated so that whole vectors of it can be loaded from any phase.
    let pattern: Vec<f32> = rates.iter().copied().cycle().take(rates.len() + 16).collect();
    let level = Level::new();
    dispatch!(level, simd => step_flat(simd, slices, &pattern, &k));
}

/// The same for a range of columns of rows of `rates.len()` values; the others are not touched.
///
/// Equal to [`adam_step`] with zero gradients and moments elsewhere, for the price of the columns
/// in use.
///
/// # Panics
/// When the lengths differ, are not whole rows, or the columns lie outside.
pub fn adam_step_columns(
    values: &mut [f32],
    gradients: &[f32],
    first: &mut [f32],
    second: &mut [f32],
    rates: &[f32],
    columns: Range<usize>,
    step: u64,
    options: &AdamOptions,
) {
    assert!(!rates.is_empty() && columns.end <= rates.len(), "columns {columns:?}");
    assert_eq!(values.len() % rates.len(), 0, "whole rows");
    let count = values.len();
    let slices = Slices { values, gradients, first, second };
    slices.check(count);
    let k = Constants::new(step, options);
    let level = Level::new();
    dispatch!(level, simd => step_columns(simd, slices, rates, columns, &k));
}

struct Slices<'a> {
    values: &'a mut [f32],
    gradients: &'a [f32],
    first: &'a mut [f32],
    second: &'a mut [f32],
}

impl Slices<'_> {
    fn check(&self, count: usize) {
        assert_eq!(self.gradients.len(), count, "one gradient per value");
        assert_eq!((self.first.len(), self.second.len()), (count, count), "one moment per value");
    }
}

struct Constants {
    beta1: f32,
    beta2: f32,
    epsilon: f32,
    correction1: f32,
    correction2: f32,
    /// Smallest magnitude of a gradient that counts.
    least: f32,
}

impl Constants {
    fn new(step: u64, options: &AdamOptions) -> Self {
        let t = step.min(1 << 30) as i32;
        let correction = |beta: f32| (1.0 / (1.0 - f64::from(beta).powi(t))) as f32;
        Self {
            beta1: options.beta1,
            beta2: options.beta2,
            epsilon: options.epsilon,
            correction1: correction(options.beta1),
            correction2: correction(options.beta2),
            least: if options.sparse { f32::from_bits(1) } else { 0.0 },
        }
    }
}

/// One vector: new values and moments.
#[inline(always)]
fn update<S: Simd>(
    simd: S,
    x: f32x16<S>,
    g: f32x16<S>,
    moments: [f32x16<S>; 2],
    rate: f32x16<S>,
    lanes: f32,
    k: &Constants,
) -> [f32x16<S>; 3] {
    let [m0, v0] = moments;
    // False for NaN and infinity.
    let size = g.abs();
    let index = f32x16::from_slice(simd, &INDEX);
    let usable = size.simd_lt(f32::MAX) & size.simd_ge(k.least) & index.simd_lt(lanes);
    let m = (m0 - g).mul_add(k.beta1, g);
    let v = (v0 - g * g).mul_add(k.beta2, g * g);
    let update = m * k.correction1 / ((v * k.correction2).sqrt() + k.epsilon);
    [usable.select(x - rate * update, x), usable.select(m, m0), usable.select(v, v0)]
}

const INDEX: [f32; 16] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];

/// Up to 16 values from `at` on, with zeros after the end.
#[inline(always)]
fn load<S: Simd>(simd: S, source: &[f32], at: usize) -> f32x16<S> {
    if at + 16 <= source.len() {
        return f32x16::from_slice(simd, &source[at..at + 16]);
    }
    let mut lanes = [0.0; 16];
    lanes[..source.len() - at].copy_from_slice(&source[at..]);
    f32x16::from_slice(simd, &lanes)
}

#[inline(always)]
fn store<S: Simd>(from: f32x16<S>, to: &mut [f32], at: usize) {
    if at + 16 <= to.len() {
        from.store_slice(&mut to[at..at + 16]);
    } else {
        let count = to.len() - at;
        to[at..].copy_from_slice(&from.as_slice()[..count]);
    }
}

#[inline(always)]
fn step_flat<S: Simd>(simd: S, s: Slices<'_>, pattern: &[f32], k: &Constants) {
    let period = pattern.len() - 16;
    let mut phase = 0;
    for at in (0..s.values.len()).step_by(16) {
        let rate = f32x16::from_slice(simd, &pattern[phase..phase + 16]);
        let moments = [load(simd, s.first, at), load(simd, s.second, at)];
        let (x, g) = (load(simd, s.values, at), load(simd, s.gradients, at));
        let [x, m, v] = update(simd, x, g, moments, rate, 16.0, k);
        store(x, s.values, at);
        store(m, s.first, at);
        store(v, s.second, at);
        phase = (phase + 16) % period;
    }
}

#[inline(always)]
fn step_columns<S: Simd>(
    simd: S,
    s: Slices<'_>,
    rates: &[f32],
    columns: Range<usize>,
    k: &Constants,
) {
    for row in 0..s.values.len() / rates.len() {
        for column in columns.clone().step_by(16) {
            let at = row * rates.len() + column;
            let rate = load(simd, rates, column);
            let moments = [load(simd, s.first, at), load(simd, s.second, at)];
            let (x, g) = (load(simd, s.values, at), load(simd, s.gradients, at));
            let lanes = (columns.end - column) as f32;
            let [x, m, v] = update(simd, x, g, moments, rate, lanes, k);
            store(x, s.values, at);
            store(m, s.first, at);
            store(v, s.second, at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_the_equations() {
        let options = AdamOptions::default();
        for n in [1usize, 15, 16, 17, 100] {
            let rates = [0.1f32, 0.01, 0.002];
            let mut x: Vec<f32> = (0..n).map(|i| i as f32).collect();
            let mut expected: Vec<f64> = x.iter().map(|&v| f64::from(v)).collect();
            let (mut m, mut v) = (vec![0.0; n], vec![0.0; n]);
            let (mut em, mut ev) = (vec![0.0f64; n], vec![0.0f64; n]);
            for step in 1..=5u64 {
                let g: Vec<f32> =
                    (0..n).map(|i| ((i as f32 + step as f32) * 0.7).sin() * 1e-3).collect();
                adam_step(&mut x, &g, &mut m, &mut v, &rates, step, &options);
                for i in 0..n {
                    let g = f64::from(g[i]);
                    em[i] = 0.9 * em[i] + 0.1 * g;
                    ev[i] = 0.999 * ev[i] + 0.001 * g * g;
                    let mh = em[i] / (1.0 - 0.9f64.powi(step as i32));
                    let vh = ev[i] / (1.0 - 0.999f64.powi(step as i32));
                    expected[i] -= f64::from(rates[i % 3]) * mh / (vh.sqrt() + 1e-15);
                }
            }
            for (a, b) in x.iter().zip(&expected) {
                assert!((f64::from(*a) - b).abs() < 1e-4, "{n}: {a} {b}");
            }
        }
    }

    #[test]
    fn broken_gradients_change_nothing() {
        let mut x = [1.0f32, 2.0, 3.0];
        let (mut m, mut v) = ([0.0; 3], [0.0; 3]);
        let g = [f32::NAN, f32::INFINITY, 1e-30];
        adam_step(&mut x, &g, &mut m, &mut v, &[0.5], 1, &AdamOptions::default());
        assert_eq!((x[0], x[1], m[0], v[1]), (1.0, 2.0, 0.0, 0.0));
        assert!(x[2].is_finite());
    }

    #[test]
    fn columns_are_stepped_as_if_alone() {
        let options = AdamOptions::default();
        let rates: Vec<f32> = (0..48).map(|i| 0.01 + i as f32 * 1e-3).collect();
        let row = rates.len();
        for columns in [0..3, 3..48, 0..48, 3..12, 17..18, 5..5] {
            let n = 3 * row;
            let mut x: Vec<f32> = (0..n).map(|i| i as f32 * 0.1).collect();
            let g: Vec<f32> = (0..n).map(|i| (i as f32 * 0.7).sin() * 1e-3).collect();
            let (mut m, mut v) = (vec![1e-3; n], vec![1e-6; n]);
            let (mut ex, mut em, mut ev) = (x.clone(), m.clone(), v.clone());
            adam_step_columns(&mut x, &g, &mut m, &mut v, &rates, columns.clone(), 3, &options);
            adam_step(&mut ex, &g, &mut em, &mut ev, &rates, 3, &options);
            for i in 0..n {
                let touched = columns.contains(&(i % row));
                let expected = if touched { ex[i] } else { i as f32 * 0.1 };
                assert_eq!(x[i], expected, "{columns:?} {i}");
                assert_eq!(m[i] == em[i] && v[i] == ev[i], touched, "{columns:?} {i}");
            }
        }
    }

    #[test]
    fn sparse_steps_leave_values_without_a_gradient_alone() {
        let mut x = [1.0f32, 2.0];
        let (mut m, mut v) = ([0.5; 2], [0.5; 2]);
        let options = AdamOptions { sparse: true, ..AdamOptions::default() };
        adam_step(&mut x, &[0.0, 1e-30], &mut m, &mut v, &[0.1], 2, &options);
        assert_eq!((x[0], m[0], v[0]), (1.0, 0.5, 0.5));
        assert!(x[1] < 2.0 && m[1] < 0.5 && v[1] < 0.5);
    }
}
