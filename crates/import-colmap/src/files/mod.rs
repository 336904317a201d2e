//! Command line of `import-colmap`; where poses and photos come from, and the capture that they become.

mod command;
mod from_colmap;
mod from_transforms;
pub(crate) mod import;
mod locate_image;
mod photo_plans;
mod photos_out;
mod process;
pub(crate) mod sfm;
pub(crate) mod source;
mod split;
mod start_points;
pub(crate) mod video;
pub(crate) mod vignetting;

pub use command::{Args, run};
