//! Errors of importing.

use motes_formats::FormatError;

/// Why an import stopped.
#[derive(Debug, thiserror::Error)]
pub enum IngestError {
    /// A file could not be read or written, or is malformed.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The data cannot be used; the text says why and what to do.
    #[error("{cause}")]
    BadInput {
        /// What is wrong, with the file or folder.
        cause: String,
        /// What to do about it.
        remedy: String,
    },
    /// The options contradict each other or what the input holds.
    #[error("{cause}")]
    Usage {
        /// What is wrong.
        cause: String,
        /// What to do about it.
        remedy: String,
    },
    /// A program or the machine failed; the data may be good.
    #[error("{cause}")]
    Failed {
        /// What happened.
        cause: String,
        /// What to do about it.
        remedy: String,
    },
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
}

/// Result of importing.
pub type Result<T> = std::result::Result<T, IngestError>;

impl IngestError {
    pub(crate) fn bad_input(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::BadInput { cause: cause.into(), remedy: remedy.into() }
    }

    pub(crate) fn usage(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Usage { cause: cause.into(), remedy: remedy.into() }
    }
}
