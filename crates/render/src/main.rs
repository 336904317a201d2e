//! Render Gaussians as pictures: views of a capture, poses between them, orbits, camera paths.
//!
//! Inputs: Gaussians (PLY) or a scene folder; a capture (`motes/capture` 1.x) or a camera path
//! (`motes/camera-path` 1.x). Output: a folder of PNG or multi-channel EXR files.
//!
//! ```text
//! render --capture OUT/capture.json --gaussians gaussians.ply --split test -o renders/
//! render --capture OUT/capture.json --gaussians gaussians.ply --between a.jpg b.jpg -o half/
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/render.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(render::files::run)
}
