//! Exit codes, with one meaning in every stage.

use std::process::ExitCode;

/// How a stage ended. A closed pipe on stdout counts as [`Self::Done`]: the reader had enough.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ExitStatus {
    /// The product is complete.
    Done = 0,
    /// Input and command line were fine, the work failed (I/O, no convergence, internal error).
    Failed = 1,
    /// The command line is wrong, or an output exists and `--overwrite` was not given.
    Usage = 2,
    /// An input is missing, malformed or not supported.
    BadInput = 3,
    /// The stage ran, but its result misses a bound that the user set.
    GateNotMet = 4,
    /// Stopped by the user; what could be saved was saved.
    Interrupted = 130,
}

impl From<ExitStatus> for ExitCode {
    fn from(status: ExitStatus) -> Self {
        Self::from(status as u8)
    }
}
