//! Imports of small projects made on the spot.

#![expect(clippy::unwrap_used, reason = "a failed step of a test is a failed test")]

mod common;
mod import;
mod sfm;
mod sources;
mod undistortion;
mod vignetting;
