//! Estimate the light of a place as a lat-long environment map.
//!
//! Input, one of: a scene folder; a splat with its capture and a point; a bracketed exposure series; pictures of a mirror ball; one
//! picture and a provider. Output: an environment map (OpenEXR, linear), with `--preview` a picture of it (PNG).
//!
//! ```text
//! estimate-environment --capture C --gaussians g.ply --at 0,0.2,1.5 -o light.exr
//! estimate-environment --mirror-ball ball/ --ball-reflectance 0.6 -o light.exr
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/estimate-environment.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(estimate_environment::files::run)
}
