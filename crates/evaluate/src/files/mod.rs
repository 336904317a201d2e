//! Command line of `evaluate`.

mod command;

pub use command::{Args, run};
