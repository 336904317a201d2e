//! Score Gaussians, or the renders of any program, against the photos of a capture.
//!
//! In: a capture (`motes/capture` 1.x); Gaussians (PLY) or folders of pictures named after views.
//! Out, each on request: JSON on stdout, `motes/metrics` 1.x, an HTML page, renders. Examples:
//!
//! ```text
//! evaluate --capture OUT/capture.json --gaussians gaussians.ply --split test --json
//! evaluate --capture OUT/capture.json --gaussians gaussians.ply --require 'psnr>=25'
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 4 a `--require` bound is
//! not met, 130 interrupted. Manual: `docs/stages/evaluate.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(evaluate::files::run)
}
