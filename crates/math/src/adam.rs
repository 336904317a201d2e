//! Adam (Kingma and Ba 2015).

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
}

impl Default for AdamOptions {
    /// 0.9, 0.999, 1e-15: gradients of a mean over all pixels are tiny, so the customary 1e-8
    /// would swallow them (Kerbl et al. 2023).
    fn default() -> Self {
        Self { beta1: 0.9, beta2: 0.999, epsilon: 1e-15 }
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
    assert_eq!(values.len(), gradients.len(), "one gradient per value");
    assert_eq!((first.len(), second.len()), (values.len(), values.len()), "one moment per value");
    let t = step.min(1 << 30) as i32;
    let correction1 = 1.0 / (1.0 - f64::from(options.beta1).powi(t));
    let correction2 = 1.0 / (1.0 - f64::from(options.beta2).powi(t));
    let k = Constants {
        beta1: options.beta1,
        beta2: options.beta2,
        epsilon: options.epsilon,
        correction1: correction1 as f32,
        correction2: correction2 as f32,
    };
    // The pattern of rates, repeated so that whole vectors of it can be loaded from any phase.
    let pattern: Vec<f32> = rates.iter().copied().cycle().take(rates.len() + 16).collect();
    let level = Level::new();
    dispatch!(level, simd => step_simd(simd, values, gradients, first, second, &pattern, &k));
}

struct Constants {
    beta1: f32,
    beta2: f32,
    epsilon: f32,
    correction1: f32,
    correction2: f32,
}

#[inline(always)]
fn step_simd<S: Simd>(
    simd: S,
    values: &mut [f32],
    gradients: &[f32],
    first: &mut [f32],
    second: &mut [f32],
    pattern: &[f32],
    k: &Constants,
) {
    let period = pattern.len() - 16;
    let mut phase = 0;
    let full = values.len() / 16 * 16;
    let mut at = 0;
    while at < values.len() {
        let count = 16.min(values.len() - at);
        let load = |source: &[f32]| -> f32x16<S> {
            if at < full {
                return f32x16::from_slice(simd, &source[at..at + 16]);
            }
            let mut lanes = [0.0; 16];
            lanes[..count].copy_from_slice(&source[at..]);
            f32x16::from_slice(simd, &lanes)
        };
        let (x, g, m0, v0) = (load(values), load(gradients), load(first), load(second));
        let rate = f32x16::from_slice(simd, &pattern[phase..phase + 16]);
        // False for NaN and infinity.
        let usable = g.abs().simd_lt(f32::MAX);
        let m = (m0 - g).mul_add(k.beta1, g);
        let v = (v0 - g * g).mul_add(k.beta2, g * g);
        let update = m * k.correction1 / ((v * k.correction2).sqrt() + k.epsilon);
        let x = usable.select(x - rate * update, x);
        let (m, v) = (usable.select(m, m0), usable.select(v, v0));
        for (to, from) in [(&mut *values, x), (&mut *first, m), (&mut *second, v)] {
            if at < full {
                from.store_slice(&mut to[at..at + 16]);
            } else {
                to[at..].copy_from_slice(&from.as_slice()[..count]);
            }
        }
        phase = (phase + 16) % period;
        at += 16;
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
}
