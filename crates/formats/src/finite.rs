//! One check for all writers: a product holds numbers, or is not written.

use std::path::Path;

use motes_scene::{ColumnValues, Gaussians};

use crate::error::{FormatError, Result};

/// Checks columns of a product, each with its name and the number of values in a row.
///
/// # Errors
/// A value is NaN or infinite.
pub fn columns<'a>(
    path: &Path,
    columns: impl IntoIterator<Item = (&'a str, &'a [f32], usize)>,
) -> Result<()> {
    for (name, values, width) in columns {
        if let Some(at) = first_bad(values, |v| !v.is_finite()) {
            return Err(refused(path, name, at / width.max(1), f64::from(values[at])));
        }
    }
    Ok(())
}

/// Checks Gaussians. An infinite opacity logit and a scale of zero are legal limits.
///
/// # Errors
/// Another value is NaN or infinite.
pub fn gaussians(path: &Path, gaussians: &Gaussians) -> Result<()> {
    let width = 3 * gaussians.sh_coefficients();
    columns(
        path,
        [
            ("mean", gaussians.means.as_flattened(), 3),
            ("rotation", gaussians.rotations.as_flattened(), 4),
            ("spherical harmonics", &gaussians.sh, width),
        ],
    )?;
    let scales = gaussians.log_scales.as_flattened();
    if let Some(at) = first_bad(scales, |v| v.is_nan() || v == f32::INFINITY) {
        return Err(refused(path, "log scale", at / 3, f64::from(scales[at])));
    }
    if let Some(row) = first_bad(&gaussians.opacity_logits, f32::is_nan) {
        return Err(refused(path, "opacity", row, f64::NAN));
    }
    for column in &gaussians.extra {
        let bad = match &column.values {
            ColumnValues::F32(v) => first_bad(v, |v| !v.is_finite()).map(|i| (i, f64::from(v[i]))),
            ColumnValues::F64(v) => v.iter().position(|v| !v.is_finite()).map(|i| (i, v[i])),
            _ => None,
        };
        if let Some((row, value)) = bad {
            return Err(refused(path, &column.name, row, value));
        }
    }
    Ok(())
}

/// Place of the first bad value. Blocks are judged whole, which takes a fraction of the time.
fn first_bad(values: &[f32], is_bad: impl Fn(f32) -> bool) -> Option<usize> {
    const BLOCK: usize = 1024;
    let block =
        values.chunks(BLOCK).position(|b| b.iter().fold(false, |any, v| any | is_bad(*v)))?;
    let start = block * BLOCK;
    values[start..].iter().position(|v| is_bad(*v)).map(|at| start + at)
}

fn refused(path: &Path, what: &str, row: usize, value: f64) -> FormatError {
    let cause = format!("not written: the {what} would be {value}");
    FormatError::invalid(path, format!("row {row}"), cause).with_remedy(
        "such rows of an input are left out by --drop-nan of edit and --drop-invalid of export; \
         a fit that ends so had input or options at the edge of what numbers hold",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bad_row_is_named_and_limits_are_legal() {
        let mut values = vec![0.5; 5000];
        assert!(columns(Path::new("a"), [("x", &values[..], 2)]).is_ok());
        values[4001] = f32::NEG_INFINITY;
        let error = columns(Path::new("a"), [("x", &values[..], 2)]).unwrap_err().to_string();
        assert!(error.contains("the x would be -inf (row 2000): a"), "{error}");
        let mut g = Gaussians {
            means: vec![[0.0; 3]; 2],
            rotations: vec![[1.0, 0.0, 0.0, 0.0]; 2],
            log_scales: vec![[f32::NEG_INFINITY; 3]; 2],
            opacity_logits: vec![f32::INFINITY; 2],
            sh: vec![0.0; 6],
            ..Gaussians::empty(0)
        };
        assert!(gaussians(Path::new("a"), &g).is_ok());
        g.opacity_logits[1] = f32::NAN;
        assert!(gaussians(Path::new("a"), &g).is_err());
    }
}
