//! Command line and files of `render`.

mod around;
mod chosen_frames;
mod command;
mod frame_writer;
mod masks;
mod model;

pub use chosen_frames::ChosenFrames;
pub use command::{Args, run};
pub use frame_writer::FrameWriter;
pub use masks::{MaskFlags, Objects};
