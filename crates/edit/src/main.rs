//! Edit a splat or a decomposed scene by a plan: select, move, delete, insert, recolor, relight, clean up.
//!
//! Inputs: a scene folder (`motes/decomposition` 1.x) or Gaussians (PLY); a plan (`motes/edit-plan` 1.x), or its operations as
//! flags. Output: the same kind, with the plan as executed.
//!
//! ```text
//! edit --scene scene/ --plan plan.json -o edited/
//! edit --gaussians in.ply --remove-floaters --rotate-euler 90,0,0 -o out.ply
//! edit --scene scene/ --selection selection.json --delete --fill plane -o edited/
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input, 130 interrupted.
//! Manual: `docs/stages/edit.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main_with_schema(edit::files::run, edit::files::plan_schema)
}
