//! Columns of Gaussians with a number from 0 to 1 each.

use crate::{ColumnValues, ExtraColumn, Gaussians};

/// Puts a column on `gaussians`, in the place of an older one.
///
/// # Panics
/// When the number of values is not that of the Gaussians.
pub(crate) fn attach(name: &str, values: Vec<f32>, gaussians: &mut Gaussians) {
    assert_eq!(values.len(), gaussians.len(), "one {name} per Gaussian");
    let values = ColumnValues::F32(values);
    match gaussians.extra.iter_mut().find(|column| column.name == name) {
        Some(column) => column.values = values,
        None => gaussians.extra.push(ExtraColumn { name: name.into(), values }),
    }
}

/// The values that `gaussians` carry, 0 to 1, NaN as 0; none without the column or with one of another type.
pub(crate) fn of(name: &str, gaussians: &Gaussians) -> Option<Vec<f32>> {
    let column = gaussians.extra.iter().find(|column| column.name == name)?;
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
        assert_eq!(of("a", &gaussians), None);
        attach("a", vec![0.0; 3], &mut gaussians);
        attach("a", vec![0.5, f32::NAN, 3.0], &mut gaussians);
        assert_eq!(gaussians.extra.len(), 1);
        assert_eq!(of("a", &gaussians), Some(vec![0.5, 0.0, 1.0]));
        assert_eq!(of("b", &gaussians), None);
    }
}
