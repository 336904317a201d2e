//! Novel views of Gaussians: which pictures to make, and the files that they become.
//!
//! - [`model`]: Gaussians and how they want to be drawn.
//! - [`frames`]: views of a capture or of a camera path, their looks, channels and videos.
//! - [`files`]: the command line.

pub mod files;
pub mod frames;
pub mod model;
mod options;
