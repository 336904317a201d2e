//! Put the runs of a lab, or a relit scene, on one page and one contact sheet.
//!
//! ```text
//! report lab out/lab/20 out/lab/10 out/lab/5 -o out/lab/report.html
//! report relight --scene scene/ --capture capture/capture.json --own own/ --light evening=evening/ -o report.html
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input.
//! Manual: `docs/stages/report.md`.

use std::process::ExitCode;

use report::files::{lab, relight};

fn main() -> ExitCode {
    motes_stage::Subjects::new("report", "Put the runs of a lab, or a relit scene, on one page")
        .with("lab", lab::run)
        .with("relight", relight::run)
        .main()
}
