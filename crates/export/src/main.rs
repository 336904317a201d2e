//! Export Gaussians and cameras to the formats of other programs.
//!
//! Inputs: Gaussians in any format of the table (PLY, compressed PLY, .splat, …), or a scene folder
//! (`motes/decomposition` 1.x); for cameras a capture (`motes/capture` 1.x) or a camera path. Output: one
//! file, whose suffix chooses the format, or the folder of a COLMAP model; beside a mesh lies its light.
//!
//! ```text
//! export gaussians.ply -o scene.splat --verify
//! export --scene scene/ --layout r3dg -o relightable.ply
//! export --capture OUT/capture.json -o OUT/transforms.json
//! export --scene scene/ --capture OUT/capture.json -o page.html
//! export --scene scene/ --format mesh --target blender -o mesh.glb
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 4 below --min-psnr, 130
//! interrupted. Manual: `docs/stages/export.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(export::files::run)
}
