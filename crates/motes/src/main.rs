//! `motes STAGE ...` finds the program of a stage and becomes it.
//!
//! A stage is looked for in (1) each folder of `MOTES_STAGE_PATH`, (2) the folder of this
//! program, (3) `../libexec/motes/` from there, (4) as `motes-STAGE` on `PATH`. The first hit
//! wins, so a researcher's own `train-splat` replaces ours without a rebuild. No stage is linked
//! in: a stage that does not build cannot break this program.

mod catalog;
mod completions;
mod dispatch;
mod find;

use std::process::ExitCode;

fn main() -> ExitCode {
    dispatch::run(std::env::args_os().skip(1))
}
