//! Relight a decomposed scene: pictures, a baked splat or a scene folder under another light; or
//! lift views that were relit by other means.
//!
//! Inputs: a scene folder (`motes/decomposition` 1.x), a light (EXR, HDR, sun and sky), poses from a
//! capture (`motes/capture` 1.x) or a camera path; or Gaussians, a capture and pictures named after its
//! views. Output: a folder of PNG or EXR files, a PLY, or a scene folder.
//!
//! ```text
//! relight --scene scene/ --environment light.exr --capture OUT/capture.json --split test -o relit/
//! relight --scene scene/ --sun azimuth=120,elevation=8 --sky -o baked.ply
//! relight --capture OUT/capture.json --gaussians gaussians.ply --from-images DIR -o relit.ply
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/relight.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(relight::files::run)
}
