//! Fit 3D Gaussians to the photos of a capture.
//!
//! Input: a capture (`motes/capture` 1.x). Output: Gaussians (INRIA-compatible PLY). Checkpoints
//! are safetensors beside the output. Example:
//! `train-splat --capture capture/capture.json -o gaussians.ply --preset balanced`. Exit codes:
//! 0 done, 1 failed, 2 usage or the output exists, 3 bad input data, 4 the fit has failed, 130
//! interrupted with a checkpoint saved. Manual: `docs/stages/train-splat.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(train_splat::files::run)
}
