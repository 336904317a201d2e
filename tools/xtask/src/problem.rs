//! What a check finds.

use std::fmt;

/// A broken rule.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Problem {
    /// Whether it fails the check.
    pub(crate) fails: bool,
    /// Path from the root.
    pub(crate) file: String,
    /// From 1; 0 is the whole file.
    pub(crate) line: usize,
    pub(crate) text: String,
}

impl Problem {
    /// A problem that fails the check. Lines count from 1; 0 is the whole file.
    pub(crate) fn error(file: impl Into<String>, line: usize, text: impl Into<String>) -> Self {
        Self { fails: true, file: file.into(), line, text: text.into() }
    }

    /// A problem that is only said.
    pub(crate) fn warning(file: impl Into<String>, line: usize, text: impl Into<String>) -> Self {
        Self { fails: false, ..Self::error(file, line, text) }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.fails { "" } else { "warning: " };
        match self.line {
            0 => write!(f, "{kind}{}: {}", self.file, self.text),
            line => write!(f, "{kind}{}:{line}: {}", self.file, self.text),
        }
    }
}
