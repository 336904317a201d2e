//! Predictions of known quality for the photos of a ground-truth folder: what a learned model would give `decompose`.
//!
//! Base color and normals of the test views are carried to the photos by their depth; what no test view shows is not predicted.
//! Then a [`Grade`] makes its errors. Those of `adversarial` are the same in all photos, since errors that differ average out.

mod grade;
mod seen_from;
mod views;

pub use grade::{Grade, Prediction};
pub use seen_from::{Seen, SurfaceCloud};
pub use views::{View, views};
