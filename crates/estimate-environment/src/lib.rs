//! The light of a place as a lat-long map.
//!
//! - [`brackets`]: response curve and radiance of an exposure series (Debevec & Malik 1997).
//! - [`mirror_ball`]: a picture of a mirror ball, unwrapped.
//! - [`place`]: a splat seen from a point, and lights that photos clip or never show, from the shading of its surfaces.
//! - [`fill`]: what was not seen, completed smoothly on the sphere.
//! - [`Summary`]: what a map holds.
//!
//! Pictures of maps are in the map's own axes: row 0 up, `motes_shading::environment::direction_from_uv`. Values are linear,
//! Rec. 709. `docs/stages/estimate-environment.md` has the equations and limits.

pub mod brackets;
pub mod cube;
pub mod files;
pub mod fill;
pub mod mirror_ball;
pub mod nonnegative;
pub mod place;
pub mod sphere;
mod summary;

pub use summary::Summary;
