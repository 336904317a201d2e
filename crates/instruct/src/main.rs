//! Turn an instruction into an edit plan, and run it when asked to.
//!
//! Inputs: a scene folder or Gaussians, a capture, labels that name objects, a sentence. Output: a plan (`motes/edit-plan` 1.x), or with
//! `--apply` what `edit` makes of it.
//!
//! ```text
//! instruct "relight this as a sunset and move the ball to the right" --scene scene/ --capture c.json --labels labels.json -o plan.json
//! instruct "make the lemon twice as large" --scene scene/ --labels labels.json --apply -o edited/
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input or an instruction that is not understood, 130 interrupted.
//! Manual: `docs/stages/instruct.md`.

use std::process::ExitCode;

fn main() -> ExitCode {
    motes_stage::main(instruct::files::run)
}
