//! Synthetic scenes and checkers for the tests of motes; a dev-dependency only.

mod broken;
mod chi_square;
mod consumers;
mod extremes;
mod gradients;
pub mod made_photos;
mod programs;
mod property;
mod scenes;
pub mod toy_capture;
pub mod toy_scene;

pub use broken::write_broken_gaussians;
pub use chi_square::chi_square_z;
pub use consumers::consumer;
pub use extremes::{ExtremeGaussian, ExtremeScene, extreme_scenes};
pub use gradients::{GradientCheck, check_gradient};
pub use programs::program;
pub use property::check_property;
pub use scenes::{orbit_pose, random_gaussians, small_camera};
