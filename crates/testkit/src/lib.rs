//! Synthetic scenes and checkers for the tests of motes; a dev-dependency only.

mod gradients;
mod scenes;

pub use gradients::{GradientCheck, check_gradient};
pub use scenes::{orbit_pose, random_gaussians, small_camera};
