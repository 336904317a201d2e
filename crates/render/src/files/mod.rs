//! Command line and files of `render`.

mod chosen_frames;
mod command;
mod masks;

pub use chosen_frames::ChosenFrames;
pub use command::{Args, run};
pub use masks::{MaskFlags, Objects};
