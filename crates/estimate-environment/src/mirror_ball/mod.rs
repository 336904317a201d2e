//! A picture of a mirror ball as a lat-long map.
//!
//! Axes of the map, in the camera (x right, y down, z forward): `map = (-x, -y, z)`, so the middle of the map is where the camera looks, and
//! what lies behind the ball is there, too: the ball shows it at its rim or hides it.

mod find;
mod unwrap;

pub use find::find_ball;
pub use unwrap::{Unwrapped, unwrap};

/// The outline of a ball in a picture, pixels; the middle of the first pixel is (0.5, 0.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    /// Center.
    pub center: [f64; 2],
    /// Radius.
    pub radius: f64,
}

#[cfg(test)]
mod tests;
