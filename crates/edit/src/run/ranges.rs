//! Ranges of the values of operations.

use super::{ColorModeDocument, LARGEST};

/// Gaussians that a mesh may become.
const MAX_MESH_GAUSSIANS: u64 = 10_000_000;

/// A mistake: the rest of the JSON pointer, the cause, the remedy.
pub(crate) type Fault = (String, String, Option<String>);

/// A number of Gaussians that a mesh becomes.
pub(crate) fn mesh_count(count: Option<u64>) -> Result<(), Fault> {
    count.map_or(Ok(()), |count| bounded("/gaussians", count, MAX_MESH_GAUSSIANS))
}

/// A color: 0 to 1, or factors from 0.
pub(crate) fn color_values(place: &str, mode: ColorModeDocument, rgb: &[f64]) -> Result<(), Fault> {
    let most = if mode == ColorModeDocument::Gain { 1e6 } else { 1.0 };
    for (i, v) in rgb.iter().enumerate() {
        range(&format!("{place}/{i}"), *v, 0.0, most)?;
    }
    Ok(())
}

/// Numbers that squares in single precision survive.
pub(crate) fn finite(place: &str, values: &[f64]) -> Result<(), Fault> {
    let Some(i) = values.iter().position(|v| !(v.abs() <= LARGEST)) else { return Ok(()) };
    let place = if values.len() > 1 { format!("{place}/{i}") } else { place.into() };
    let cause = match values[i].is_finite() {
        true => format!("{:e} is farther from 0 than {LARGEST:e}", values[i]),
        false => format!("{} is not a finite number", values[i]),
    };
    Err((place, cause, None))
}

/// A vector of any length above 0.
pub(crate) fn direction(place: &str, values: &[f64]) -> Result<(), Fault> {
    finite(place, values)?;
    let length = values.iter().map(|v| v * v).sum::<f64>();
    if length > 0.0 && length.is_finite() {
        return Ok(());
    }
    Err((place.into(), format!("{values:?} has no direction"), None))
}

/// A number above 0.
pub(crate) fn positive(place: &str, value: f64) -> Result<(), Fault> {
    if value > 0.0 && value.is_finite() {
        return range(place, value, 1.0 / LARGEST, LARGEST);
    }
    Err((place.into(), format!("{value} is not a number above 0"), None))
}

/// A number from `low` to `high`.
pub(crate) fn range(place: &str, value: f64, low: f64, high: f64) -> Result<(), Fault> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err((place.into(), format!("{value:?} is not from {low:?} to {high:?}"), None))
}

/// A count from 1 to `most`.
pub(crate) fn bounded(place: &str, value: u64, most: u64) -> Result<(), Fault> {
    if (1..=most).contains(&value) {
        return Ok(());
    }
    Err((place.into(), format!("{value} is not from 1 to {most}"), None))
}
