//! Command line, inputs, and the program that opens the page.

mod browser;
mod command;
mod inputs;
mod maps;
mod named;
mod reopen;
mod report;
mod snapshots;

pub use command::{Args, run};
pub use report::ViewReport;
