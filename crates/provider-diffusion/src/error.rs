//! Why there is no picture.

use std::path::{Path, PathBuf};

use motes_formats::FormatError;
use thiserror::Error;

/// Why there is no picture. The text says the cause, and the remedy on a line that starts with `help:`.
#[derive(Debug, Error)]
pub enum DiffusionError {
    /// Weights, or what lies beside them, cannot be used.
    #[error("{cause}: {}\nhelp: {help}", path.display())]
    Weights {
        /// What is wrong.
        cause: String,
        /// The file or folder.
        path: PathBuf,
        /// What to do.
        help: String,
    },
    /// The request or a flag asks for what cannot be done.
    #[error("{cause}\nhelp: {help}")]
    Request {
        /// What is wrong.
        cause: String,
        /// What to do.
        help: String,
    },
    /// A picture cannot be used.
    #[error("{cause}\nhelp: {help}")]
    Picture {
        /// What is wrong.
        cause: String,
        /// What to do.
        help: String,
    },
    /// The networks answer nothing that can be shown.
    #[error(
        "the network answers values that are not finite\nhelp: --precision f32, or check the weights"
    )]
    NotFinite,
    /// A computation failed.
    #[error(
        "the computation failed ({0})\nhelp: if memory ran out, ask for smaller pictures (--size)"
    )]
    Computation(#[from] candle_core::Error),
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FormatError),
}

/// What may end without a picture.
pub(crate) type Result<T> = std::result::Result<T, DiffusionError>;

impl DiffusionError {
    pub(crate) fn weights(cause: impl Into<String>, path: &Path, help: impl Into<String>) -> Self {
        Self::Weights { cause: cause.into(), path: path.into(), help: help.into() }
    }

    pub(crate) fn request(cause: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Request { cause: cause.into(), help: help.into() }
    }

    pub(crate) fn picture(cause: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Picture { cause: cause.into(), help: help.into() }
    }
}
