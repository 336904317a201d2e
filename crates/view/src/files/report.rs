//! What the stage says when it ends.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

/// What was done on the page.
#[derive(Clone, Debug, Serialize)]
pub struct ViewReport {
    /// Acts in the plan.
    pub acts: usize,
    /// Where the plan is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output: Option<PathBuf>,
}

impl fmt::Display for ViewReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let acts = if self.acts == 1 { "act" } else { "acts" };
        match &self.output {
            Some(path) => writeln!(f, "a plan of {} {acts}: {}", self.acts, path.display()),
            None => writeln!(f, "a plan of {} {acts}", self.acts),
        }
    }
}
