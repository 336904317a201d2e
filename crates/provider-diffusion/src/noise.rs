//! Normal noise by seed.

use candle_core::Tensor;
use motes_math::rng::keyed_rng;
use rand::RngExt as _;

use crate::error::Result;

/// The purpose of these streams among those of a seed.
const STREAM: u64 = 0x6469_6666;

/// Where noise comes from.
pub trait Noise {
    /// So many values of a normal distribution.
    fn values(&mut self, count: usize) -> Vec<f32>;

    /// Noise in the shape of latents, where they are.
    ///
    /// # Errors
    /// Memory ran out.
    fn like(&mut self, latents: &Tensor) -> Result<Tensor> {
        let values = self.values(latents.elem_count());
        Ok(Tensor::from_vec(values, latents.shape(), latents.device())?)
    }
}

/// The noise of a seed: the same on every device, at any number of threads.
pub struct Keyed {
    seed: u64,
    draws: u64,
}

impl Keyed {
    /// From the first draw on.
    pub fn new(seed: u64) -> Self {
        Self { seed, draws: 0 }
    }
}

impl Noise for Keyed {
    fn values(&mut self, count: usize) -> Vec<f32> {
        let mut rng = keyed_rng(self.seed, STREAM, self.draws);
        self.draws += 1;
        // Box and Muller (1958). The first number is above 0, so its logarithm is finite.
        let mut pair = || {
            let (a, b) = (1.0 - rng.random::<f64>(), rng.random::<f64>());
            let (sin, cos) = (std::f64::consts::TAU * b).sin_cos();
            let radius = (-2.0 * a.ln()).sqrt();
            [(radius * cos) as f32, (radius * sin) as f32]
        };
        let mut values: Vec<f32> = (0..count.div_ceil(2)).flat_map(|_| pair()).collect();
        values.truncate(count);
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_normal_and_differ_from_each_other() {
        // Chi-square over 16 bins of equal probability: 15 degrees of freedom, 0.1 % point 37.7.
        const EDGES: [f64; 8] =
            [0.0, 0.157_31, 0.318_64, 0.488_78, 0.674_49, 0.887_15, 1.150_35, 1.534_12];
        let (mut one, count) = (Keyed::new(5), 32_001);
        let values = one.values(count);
        let mut bins = [0u32; 16];
        for v in &values {
            let half = EDGES.iter().filter(|e| f64::from(v.abs()) >= **e).count() - 1;
            bins[half + if *v < 0.0 { 8 } else { 0 }] += 1;
        }
        let expected = count as f64 / 16.0;
        let chi2: f64 = bins.iter().map(|n| (f64::from(*n) - expected).powi(2) / expected).sum();
        assert!(chi2 < 37.7, "{chi2} {bins:?}");
        assert_ne!(one.values(count), values);
        assert_eq!(Keyed::new(5).values(count), values);
        assert_ne!(Keyed::new(6).values(count), values);
    }
}
