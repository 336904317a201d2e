//! How far a decomposition is to be trusted, Gaussian by Gaussian.

use crate::{ColumnValues, ExtraColumn, Gaussians};

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
    assert_eq!(confidence.len(), gaussians.len(), "one confidence per Gaussian");
    let values = ColumnValues::F32(confidence);
    match gaussians.extra.iter_mut().find(|column| column.name == CONFIDENCE_COLUMN) {
        Some(column) => column.values = values,
        None => gaussians.extra.push(ExtraColumn { name: CONFIDENCE_COLUMN.into(), values }),
    }
}

/// The confidence that `gaussians` carry, 0 to 1, NaN as 0; none without the column or with one of another type.
pub fn confidence_of(gaussians: &Gaussians) -> Option<Vec<f32>> {
    let column = gaussians.extra.iter().find(|column| column.name == CONFIDENCE_COLUMN)?;
    match &column.values {
        // `max` first: it turns NaN into 0.
        ColumnValues::F32(v) => Some(v.iter().map(|v| v.max(0.0).clamp(0.0, 1.0)).collect()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_column_comes_back_in_its_range_and_replaces_an_older_one() {
        let mut gaussians = Gaussians { means: vec![[0.0; 3]; 3], ..Gaussians::empty(0) };
        assert_eq!(confidence_of(&gaussians), None);
        attach_confidence(vec![0.0; 3], &mut gaussians);
        attach_confidence(vec![0.5, f32::NAN, 3.0], &mut gaussians);
        assert_eq!(gaussians.extra.len(), 1);
        assert_eq!(confidence_of(&gaussians), Some(vec![0.5, 0.0, 1.0]));
    }
}
