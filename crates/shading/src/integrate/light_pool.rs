//! Directions toward the light, drawn once and shared by all points.
//!
//! Light at infinity looks the same from everywhere, so its samples need no point. The pool is
//! one long Sobol' sequence; its aligned blocks are stratified sets of their own, and every point
//! takes the block that its key picks. A point then pays a load instead of a draw and a look-up.
//! Approximated: all points together see the light as a sum over the pool; with 65536
//! directions that differs from the integral by less than the noise of a thousand points.

use std::sync::{Arc, Mutex, PoisonError};

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
        if light.is_black() {
            return Self { samples: vec![None; size as usize] };
        }
        // A count of one keeps the order of the sequence: consecutive points stay a net.
        let points = PointSet::new(seed, 0, PURPOSE, 1);
        Self { samples: (0..size).map(|i| light.sample(points.point(i))).collect() }
    }

    /// As [`Self::new`]; drawn once for all who ask the same light with the same seed one after the other.
    pub fn shared(light: &Environment, log2_size: u32, seed: u64) -> Arc<Self> {
        let last = || light.pool.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((key, pool)) = last().as_ref()
            && *key == (log2_size, seed)
        {
            return pool.clone();
        }
        // Not under the lock: whoever comes meanwhile draws the same numbers.
        let pool = Arc::new(Self::new(light, log2_size, seed));
        *last() = Some(((log2_size, seed), pool.clone()));
        pool
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

/// The pool that was drawn last from a light, and its size and seed; copies of the light share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct LastPool(Arc<Mutex<Option<Drawn>>>);

/// Logarithm of the size and seed, and what was drawn.
type Drawn = ((u32, u64), Arc<LightPool>);

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::environment::SunDisc;

    fn directions(pool: &LightPool) -> Vec<Option<Vec3>> {
        pool.block(3, 64).iter().map(|s| s.map(|s| s.to_light)).collect()
    }

    #[test]
    fn a_shared_pool_is_the_one_that_would_be_drawn() {
        let sun = SunDisc::new(Vec3::Y, 0.2, Vec3::ONE);
        let light = Environment::new(None, Some(sun));
        let other = Environment::new(None, Some(SunDisc::new(Vec3::X, 0.2, Vec3::ONE)));
        for (log2_size, seed) in [(10, 1), (10, 2), (12, 2), (10, 1)] {
            for light in [&light, &light.clone(), &other] {
                let shared = LightPool::shared(light, log2_size, seed);
                let own = LightPool::new(light, log2_size, seed);
                assert_eq!(shared.samples.len(), 1 << log2_size);
                assert_eq!(directions(&shared), directions(&own));
            }
        }
        let (first, second) = (LightPool::shared(&light, 10, 5), LightPool::shared(&light, 10, 5));
        assert!(Arc::ptr_eq(&first, &second));
    }

    #[test]
    fn darkness_has_no_samples() {
        let pool = LightPool::new(&Environment::default(), 8, 0);
        assert_eq!(directions(&pool), vec![None; 64]);
    }
}
