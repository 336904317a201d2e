//! Say what files and folders are, and what they hold.
//!
//! Inputs: any file or folder. Output: a description on standard output, or in a file.
//!
//! ```text
//! info gaussians.ply scene/
//! info *.spz --json
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 an input is missing or broken.
//! Manual: `docs/stages/info.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(info::files::run)
}
