//! What can be wrong with a fit before it starts.

/// An error the caller can act on.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// A flag's value cannot be used.
    #[error("{flag} '{value}': {why}")]
    Option {
        /// The flag.
        flag: &'static str,
        /// Its value.
        value: String,
        /// What is wrong.
        why: String,
    },
    /// There is nothing to fit to.
    #[error("the capture has no training view")]
    NoViews,
    /// A checkpoint does not belong to this capture or these options.
    #[error("the checkpoint does not fit: {0}")]
    Checkpoint(String),
}
