//! Light that is not at infinity: what a place receives over what the environment gives it.

use crate::{ColumnValues, ExtraColumn, Gaussians};

/// The columns of the file, one per channel: natural logarithm of the factor on the irradiance, linear RGB.
pub const LOCAL_LIGHT_COLUMNS: [&str; 3] = ["local_light_0", "local_light_1", "local_light_2"];

/// Puts the columns on `gaussians`, in the place of older ones.
///
/// # Panics
/// When the number of values is not that of the Gaussians.
pub fn attach_local_light(log_factor: &[[f32; 3]], gaussians: &mut Gaussians) {
    assert_eq!(log_factor.len(), gaussians.len(), "one factor per Gaussian");
    for (c, name) in LOCAL_LIGHT_COLUMNS.into_iter().enumerate() {
        let values = ColumnValues::F32(log_factor.iter().map(|l| l[c]).collect());
        match gaussians.extra.iter_mut().find(|column| column.name == name) {
            Some(column) => column.values = values,
            None => gaussians.extra.push(ExtraColumn { name: name.into(), values }),
        }
    }
}

/// The logarithms that `gaussians` carry, 0 for what is not finite; none without all three columns.
pub fn local_light_of(gaussians: &Gaussians) -> Option<Vec<[f32; 3]>> {
    let column = |name: &str| {
        let column = gaussians.extra.iter().find(|column| column.name == name)?;
        match &column.values {
            ColumnValues::F32(values) => Some(values),
            _ => None,
        }
    };
    let [r, g, b] = LOCAL_LIGHT_COLUMNS.map(column);
    let (r, g, b) = (r?, g?, b?);
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    Some((0..gaussians.len()).map(|i| [r[i], g[i], b[i]].map(finite)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_columns_come_back_and_replace_older_ones() {
        let mut gaussians = Gaussians { means: vec![[0.0; 3]; 2], ..Gaussians::empty(0) };
        assert_eq!(local_light_of(&gaussians), None);
        attach_local_light(&[[0.0; 3]; 2], &mut gaussians);
        attach_local_light(&[[0.5, -1.0, 2.0], [f32::NAN, 0.0, 1.0]], &mut gaussians);
        assert_eq!(gaussians.extra.len(), 3);
        let back = local_light_of(&gaussians);
        assert_eq!(back, Some(vec![[0.5, -1.0, 2.0], [0.0, 0.0, 1.0]]));
    }
}
