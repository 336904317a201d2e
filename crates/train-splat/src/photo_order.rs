//! The order in which photos are fitted to.

use motes_math::rng::keyed_rng;
use rand::seq::SliceRandom;

/// Every photo once, in an order drawn anew for every round: keyed by (seed, purpose, step), so that it depends on nothing else.
#[derive(Debug)]
pub struct PhotoOrder {
    order: Vec<usize>,
    seed: u64,
    purpose: u64,
}

impl PhotoOrder {
    /// Of so many photos.
    pub fn new(photos: usize, seed: u64, purpose: u64) -> Self {
        Self { order: (0..photos).collect(), seed, purpose }
    }

    /// The photo of a step, asked for step by step from 0; none without photos.
    pub fn at(&mut self, step: u32) -> Option<usize> {
        let turn = step as usize % self.order.len().max(1);
        if turn == 0 {
            self.order.sort_unstable();
            self.order.shuffle(&mut keyed_rng(self.seed, self.purpose, u64::from(step)));
        }
        self.order.get(turn).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_round_has_every_photo_once_in_an_order_of_its_own() {
        let drawn = |seed| -> Vec<usize> {
            let mut order = PhotoOrder::new(9, seed, 4);
            (0..27).filter_map(|step| order.at(step)).collect()
        };
        let first = drawn(1);
        for round in first.chunks(9) {
            let mut sorted = round.to_vec();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..9).collect::<Vec<_>>());
        }
        assert!(first[..9] != first[9..18] && first != drawn(2) && first == drawn(1));
        assert_eq!(PhotoOrder::new(0, 1, 1).at(0), None);
    }
}
