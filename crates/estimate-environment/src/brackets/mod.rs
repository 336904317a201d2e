//! Radiance of a scene that does not move, from pictures of several exposures.
//!
//! [`Response::find`] recovers how a camera maps exposure to pixel values, [`merge`] averages the pictures in log radiance, and leaves
//! out what moved ([`MergeOptions::deghost`]).

mod ghosts;
mod merge;
mod response;

use motes_scene::ImageF32;
use thiserror::Error;

pub use merge::{MergeOptions, Merged, merge};
pub use response::Response;

/// One picture of a series.
#[derive(Clone, Debug)]
pub struct Exposed {
    /// RGB, 0 to 1 between black and saturation; encoded by the camera, or linear.
    pub image: ImageF32,
    /// `log2` of the exposure: time x sensitivity over the square of the f-number.
    pub stops: f64,
}

/// Why a series cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum BracketError {
    /// One picture is no series.
    #[error("a series has two exposures or more, not {0}")]
    TooFew(usize),
    /// Pictures of several sizes.
    #[error("picture {index} has {found:?} pixels, the first one {expected:?}")]
    Size {
        /// Which, from 0.
        index: usize,
        /// Its size.
        found: (usize, usize),
        /// The size of the first one.
        expected: (usize, usize),
    },
    /// All have one exposure.
    #[error("all pictures have the same exposure")]
    SameExposure,
    /// Nothing lies between black and white in two pictures.
    #[error("too little is well exposed in two pictures at once: the response cannot be found")]
    NoOverlap,
}

/// Weight of a value from 0 to 1 (Debevec & Malik 1997): a hat, 0 at black and at saturation.
pub fn hat(value: f32) -> f32 {
    let v = value.clamp(0.0, 1.0);
    2.0 * v.min(1.0 - v)
}

/// Checks that pictures are a series.
///
/// # Errors
/// There are fewer than two, of several sizes, or all of one exposure.
pub fn check(series: &[Exposed]) -> Result<(), BracketError> {
    let size = |e: &Exposed| (e.image.width, e.image.height);
    if series.len() < 2 {
        return Err(BracketError::TooFew(series.len()));
    }
    let expected = size(&series[0]);
    if let Some(index) = series.iter().position(|e| size(e) != expected) {
        return Err(BracketError::Size { index, found: size(&series[index]), expected });
    }
    if series.iter().all(|e| (e.stops - series[0].stops).abs() < 0.01) {
        return Err(BracketError::SameExposure);
    }
    Ok(())
}

/// The picture whose values weigh most: what others are compared with.
pub fn reference(series: &[Exposed]) -> usize {
    let sum = |e: &Exposed| e.image.data.iter().map(|v| f64::from(hat(*v))).sum::<f64>();
    let sums: Vec<f64> = series.iter().map(sum).collect();
    (0..sums.len()).max_by(|a, b| sums[*a].total_cmp(&sums[*b]).then(b.cmp(a))).unwrap_or(0)
}

#[cfg(test)]
mod tests;
