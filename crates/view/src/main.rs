//! Look at a splat or a scene in a browser, select, light and edit it there, and save the plan of the edits.
//!
//! Inputs: a scene folder or Gaussians; a capture for photos and clicks. Output: a page on the loopback address, and the plan
//! (`motes/edit-plan` 1.x) of what was done on it.
//!
//! ```text
//! view scene/ --capture capture/
//! view gaussians.ply --no-browser --json
//! ```
//!
//! Exit codes: 0 ended from the page, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/view.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(view::files::run)
}
