//! Inverse rendering: photos and their Gaussians to surface, material and light.
//!
//! Inputs: captures (`motes/capture` 1.x) of one scene, Gaussians (PLY). Output: a scene folder
//! (`motes/decomposition` 1.x): Gaussians with material columns, `surface.ply`, `environment.exr`,
//! `decomposition.json`, previews.
//!
//! ```text
//! decompose --capture OUT/capture.json --gaussians gaussians.ply -o scene/
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/decompose.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    // The photos are held as pictures of many kinds, one step after the other.
    motes_stage::give_back_freed_arrays();
    motes_stage::main(decompose::files::run)
}
