//! Bounds and non-finite values of arrays.

use motes_scene::{ColumnValues, Gaussians};

use crate::Bounds;

/// The smallest box around the finite positions; `None` without any.
pub fn bounds(positions: &[[f32; 3]]) -> Option<Bounds> {
    let finite = positions.iter().filter(|p| p.iter().all(|v| v.is_finite()));
    finite.fold(None, |found: Option<Bounds>, p| {
        let Bounds { min, max } = found.unwrap_or(Bounds { min: *p, max: *p });
        Some(Bounds {
            min: std::array::from_fn(|i| min[i].min(p[i])),
            max: std::array::from_fn(|i| max[i].max(p[i])),
        })
    })
}

/// How many values are NaN or infinite.
pub fn non_finite(values: &[f32]) -> u64 {
    values.iter().filter(|v| !v.is_finite()).count() as u64
}

/// How many values of Gaussians are NaN or infinite, extra columns included. Infinite opacity logits and log scales of minus
/// infinity are counted, too, though they are legal: see [`Gaussians::invalid_rows`].
pub fn non_finite_values(gaussians: &Gaussians) -> u64 {
    let standard = [
        gaussians.means.as_flattened(),
        gaussians.rotations.as_flattened(),
        gaussians.log_scales.as_flattened(),
        &gaussians.opacity_logits,
        &gaussians.sh,
    ];
    let extra = gaussians.extra.iter().map(|column| match &column.values {
        ColumnValues::F32(values) => non_finite(values),
        ColumnValues::F64(values) => values.iter().filter(|v| !v.is_finite()).count() as u64,
        _ => 0,
    });
    standard.into_iter().map(non_finite).sum::<u64>() + extra.sum::<u64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_of_finite_positions() {
        let found = bounds(&[[1.0, 2.0, 3.0], [f32::NAN, 9.0, 9.0], [-1.0, 4.0, 0.0]]).unwrap();
        assert_eq!((found.min, found.max), ([-1.0, 2.0, 0.0], [1.0, 4.0, 3.0]));
        assert!(bounds(&[]).is_none() && bounds(&[[f32::INFINITY; 3]]).is_none());
    }

    #[test]
    fn every_column_is_searched() {
        let mut gaussians = Gaussians::empty(0);
        gaussians.opacity_logits = vec![0.0, f32::INFINITY];
        gaussians.sh = vec![f32::NAN; 3];
        assert_eq!(non_finite_values(&gaussians), 4);
    }
}
