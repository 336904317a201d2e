//! How far a decomposition is to be trusted, Gaussian by Gaussian.

use crate::{Gaussians, unit_column};

/// The column of the file: 0 nothing is known, 1 as sure as the photos allow.
pub const CONFIDENCE_COLUMN: &str = "confidence";

/// Photos to know a place by.
const PHOTOS: f32 = 1.5;

/// The share of all there is to know about a place that `photos` pictures tell, `1 - exp(-n / 1.5)`: one tells nothing about shape, three
/// tell most (0.86). A Gaussian's confidence is what its photos confirm, as a mean, times this.
pub fn photos_share(photos: u32) -> f32 {
    1.0 - (-(photos as f32) / PHOTOS).exp()
}

/// Puts the column on `gaussians`, in the place of an older one.
///
/// # Panics
/// When the number of values is not that of the Gaussians.
pub fn attach_confidence(confidence: Vec<f32>, gaussians: &mut Gaussians) {
    unit_column::attach(CONFIDENCE_COLUMN, confidence, gaussians);
}

/// The confidence that `gaussians` carry, 0 to 1, NaN as 0; none without the column or with one of another type.
pub fn confidence_of(gaussians: &Gaussians) -> Option<Vec<f32>> {
    unit_column::of(CONFIDENCE_COLUMN, gaussians)
}
