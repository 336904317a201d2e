//! Put the runs of a lab, a relit scene, or the scores of several runs on one page.
//!
//! ```text
//! report lab out/lab/20 out/lab/10 out/lab/5 -o out/lab/report.html
//! report relight --scene scene/ --capture capture/capture.json --own own/ --light evening=evening/ -o report.html
//! report table ours=a/metrics.json base=b/metrics.json -o table.tex
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input.
//! Manual: `docs/stages/report.md`.

use std::process::ExitCode;

use report::files::{lab, relight, table};

fn main() -> ExitCode {
    motes_stage::Subjects::new("report", "Put runs of the lab, a relit scene or scores on one page")
        .with("lab", lab::run)
        .with("relight", relight::run)
        .with("table", table::run)
        .main()
}
