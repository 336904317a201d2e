//! A plan, applied to a state.
//!
//! [`prepare`] checks what needs no Gaussians: files, names, which operations an `undo` takes back. [`run_plan`] applies the rest in
//! order. Nothing is written here: pictures and the record are returned.

mod appearance;
mod apply;
mod asset;
mod context;
mod inserting;
mod light;
mod moving;
mod prepare;
mod preview;
mod removing;
mod select;
mod shadows;
mod style;
mod values;

pub use apply::{Edited, run_plan};
pub use context::{EditError, Editors, Resources};
pub use prepare::{Prepared, prepare};
pub use preview::{Preview, orbit_camera, picture, whole_extent};
