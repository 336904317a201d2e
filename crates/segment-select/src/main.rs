//! Select Gaussians by clicks, boxes, masks, shapes, colors and properties.
//!
//! Inputs: Gaussians (PLY) or a scene folder (`motes/decomposition` 1.x); for prompts in pixels a
//! capture (`motes/capture` 1.x). Output: `selection.json` (`motes/selection` 1.0); on request overlay
//! pictures, a PLY with a column of labels, a PLY with Gaussians split at the selection's edge.
//!
//! ```text
//! segment-select --capture OUT/capture.json --gaussians gaussians.ply --click VIEW,X,Y -o selection.json
//! segment-select --gaussians gaussians.ply --select sphere=0,0,0,0.5 --select subtract:property=opacity,lt,0.1 -o selection.json
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input or nothing selected, 130
//! interrupted. Manual: `docs/stages/segment-select.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(segment_select::files::run)
}
