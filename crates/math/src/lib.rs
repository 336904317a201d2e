//! Pure numerics: no files, no scene types, no thread-pool policy, no hidden randomness.

pub mod metrics;
pub mod rng;
pub mod sh;
pub mod sigmoid;
