//! What Gaussians show of the sky.

use crate::{Gaussians, unit_column};

/// The column of the file: the share of what photos show through a Gaussian that is sky, 0 to 1.
pub const SKY_COLUMN: &str = "sky";

/// Puts the column on `gaussians`, in the place of an older one.
///
/// # Panics
/// When the number of values is not that of the Gaussians.
pub fn attach_sky(sky: Vec<f32>, gaussians: &mut Gaussians) {
    unit_column::attach(SKY_COLUMN, sky, gaussians);
}

/// The share of sky that `gaussians` carry, 0 to 1, NaN as 0; none without the column or with one of another type.
pub fn sky_of(gaussians: &Gaussians) -> Option<Vec<f32>> {
    unit_column::of(SKY_COLUMN, gaussians)
}
