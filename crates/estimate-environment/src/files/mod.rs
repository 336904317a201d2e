//! The files around an estimate: scenes, splats, photos in; an environment map out.

mod arguments;
mod ball;
mod brackets;
mod command;
mod frame;
mod place;
mod preview;
mod provider;
mod report;
mod scene;
mod values;

pub use arguments::Args;
pub use command::run;
pub use report::Report;
