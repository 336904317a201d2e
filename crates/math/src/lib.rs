//! Pure numerics: no files, no scene types, no thread-pool policy, no hidden randomness.

pub mod adam;
pub mod additive_fit;
pub mod codebook;
pub mod disjoint_sets;
pub mod falloff;
pub mod kmeans;
pub mod knn;
pub mod luminance;
pub mod median;
pub mod metrics;
pub mod resample;
pub mod rng;
pub mod sh;
pub mod sh_rotation;
pub mod sigmoid;
pub mod srgb;
pub mod tone_curve;
