//! Command line and files of `evaluate`.

mod command;
mod lpips_weights;
pub mod photos;
mod scoring;
mod training;

pub use command::{Args, run};
pub use training::read_training;
