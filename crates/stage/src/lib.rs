//! What every binary of motes shares: common flags, configuration files, messages, progress,
//! interruption, the output guard, exit codes, run records. No algorithms.
//!
//! A stage is a page:
//!
//! ```no_run
//! use std::path::PathBuf;
//!
//! use motes_stage::{CommonArgs, Context, HasCommon};
//!
//! /// Count the bytes of a file
//! #[derive(clap::Parser, serde::Serialize)]
//! #[command(name = "count-bytes")]
//! struct Args {
//!     /// File to read
//!     input: PathBuf,
//!     #[command(flatten)]
//!     #[serde(flatten)]
//!     common: CommonArgs,
//! }
//!
//! impl HasCommon for Args {
//!     fn common(&self) -> &CommonArgs {
//!         &self.common
//!     }
//! }
//!
//! #[derive(serde::Serialize)]
//! struct Report {
//!     bytes: u64,
//! }
//!
//! impl std::fmt::Display for Report {
//!     fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
//!         writeln!(f, "{} bytes", self.bytes)
//!     }
//! }
//!
//! fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
//!     context.input("input", &args.input)?;
//!     Ok(Report { bytes: std::fs::metadata(&args.input)?.len() })
//! }
//!
//! fn main() -> std::process::ExitCode {
//!     motes_stage::main(run)
//! }
//! ```

mod clock;
mod common;
mod config;
mod context;
mod error;
mod exit_status;
mod fingerprint;
mod freed_arrays;
mod generate;
mod habits;
mod help_order;
mod interrupt;
mod large_pages;
mod leading_inputs;
mod log;
mod memory;
mod panics;
mod progress;
mod provenance;
mod resources;
mod revision;
mod run;
mod short_help;
mod stdout;
mod subjects;

pub use common::{COMMON_BASIC, CommonArgs, Generate, HasCommon, Preset, ProgressMode};
pub use context::Context;
pub use error::{Explanation, OrBadInput, StageError, outcome_of};
pub use exit_status::ExitStatus;
pub use freed_arrays::{give_back_freed_arrays, give_back_freed_memory};
pub use habits::Habit;
pub use progress::Progress;
pub use provenance::record_path;
pub use run::{INVOKED_AS_VARIABLE, main, main_with_schema};
pub use stdout::Stdout;
pub use subjects::Subjects;
