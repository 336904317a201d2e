//! Directions towards the light, drawn once and shared by all points.
//!
//! Light at infinity looks the same from everywhere, so its samples need no point. The pool is
//! one long Sobol' sequence; its aligned blocks are stratified sets of their own, and every point
//! takes the block that its key picks. A point then pays a load instead of a draw and a look-up.
//! Approximated: all points together see the light as a sum over the pool; with 65536
//! directions that differs from the integral by less than the noise of a thousand points.

use crate::environment::{Environment, LightSample};
use crate::sampling::PointSet;

/// Keeps these points apart from others of the same seed.
const PURPOSE: u32 = 0x900d;

/// Samples of one light.
#[derive(Clone, Debug)]
pub struct LightPool {
    samples: Vec<Option<LightSample>>,
}

impl LightPool {
    /// Draws `2^log2_size` directions, at most 2^24.
    pub fn new(light: &Environment, log2_size: u32, seed: u64) -> Self {
        let size = 1u32 << log2_size.min(24);
        // A count of one keeps the order of the sequence: consecutive points stay a net.
        let points = PointSet::new(seed, 0, PURPOSE, 1);
        Self { samples: (0..size).map(|i| light.sample(points.point(i))).collect() }
    }

    /// `count` samples of the block that `key` picks; `None` in it when all is black. Counts over
    /// the size of the pool are cut to it.
    #[inline]
    pub fn block(&self, key: u64, count: u32) -> &[Option<LightSample>] {
        let width = (count.max(1).next_power_of_two() as usize).min(self.samples.len());
        let start = (key % (self.samples.len() / width) as u64) as usize * width;
        &self.samples[start..start + (count as usize).min(width)]
    }
}
