//! Check programs that run learned models for stages.
//!
//! ```text
//! provider check 'python3 my-provider.py' --kind relight
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 no such program, 4 a check failed.
//! Manual: `docs/stages/provider.md`.

use std::process::ExitCode;

use provider::files::check;

fn main() -> ExitCode {
    motes_stage::Subjects::new("provider", "Check programs that run learned models for stages")
        .with("check", check::run)
        .main()
}
