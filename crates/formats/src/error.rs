//! The one error type of every reader and writer here.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Result of reading or writing a file.
pub type Result<T> = std::result::Result<T, FormatError>;

/// What can be wrong with a file, in three kinds that a caller can act on.
///
/// Displayed as `cause (place): path`, and the remedy, when there is one, on a line of its own
/// that starts with `help:`.
#[derive(Debug)]
pub enum FormatError {
    /// The operating system refused.
    Io {
        /// The file.
        path: PathBuf,
        /// What it answered.
        source: io::Error,
    },
    /// The file breaks the rules of its format.
    Invalid {
        /// The file.
        path: PathBuf,
        /// Where in the file: a header line, a byte offset, a record.
        place: String,
        /// What is wrong.
        cause: String,
        /// What the user can do about it.
        remedy: Option<String>,
    },
    /// The file may be right, but this program cannot read it.
    NotSupported {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: String,
        /// What is not supported.
        cause: String,
        /// What the user can do about it.
        remedy: Option<String>,
    },
}

impl FormatError {
    /// A refusal of the operating system. A file that ends too early is [`Self::Invalid`].
    pub fn io(path: impl AsRef<Path>, source: io::Error) -> Self {
        let path = path.as_ref().to_owned();
        if source.kind() == io::ErrorKind::UnexpectedEof {
            Self::invalid(path, "end of file", "the file ends in the middle of its data")
        } else {
            Self::Io { path, source }
        }
    }

    /// A broken file. An empty `place` is not shown.
    pub fn invalid(
        path: impl AsRef<Path>,
        place: impl Into<String>,
        cause: impl Into<String>,
    ) -> Self {
        let path = path.as_ref().to_owned();
        Self::Invalid { path, place: place.into(), cause: cause.into(), remedy: None }
    }

    /// A file of a kind that is not supported. An empty `place` is not shown.
    pub fn not_supported(
        path: impl AsRef<Path>,
        place: impl Into<String>,
        cause: impl Into<String>,
    ) -> Self {
        let path = path.as_ref().to_owned();
        Self::NotSupported { path, place: place.into(), cause: cause.into(), remedy: None }
    }

    /// The same error with what the user can do about it.
    #[must_use]
    pub fn with_remedy(mut self, text: impl Into<String>) -> Self {
        match &mut self {
            Self::Io { .. } => {}
            Self::Invalid { remedy, .. } | Self::NotSupported { remedy, .. } => {
                *remedy = Some(text.into());
            }
        }
        self
    }

    /// The file that the error is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::Io { path, .. }
            | Self::Invalid { path, .. }
            | Self::NotSupported { path, .. } => path,
        }
    }
}

impl fmt::Display for FormatError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { path, source } => write!(f, "{source}: {}", path.display()),
            Self::Invalid { path, place, cause, remedy }
            | Self::NotSupported { path, place, cause, remedy } => {
                one_line(f, cause)?;
                if !place.is_empty() {
                    f.write_str(" (")?;
                    one_line(f, place)?;
                    f.write_str(")")?;
                }
                write!(f, ": {}", path.display())?;
                remedy.as_ref().map_or(Ok(()), |remedy| write!(f, "\nhelp: {remedy}"))
            }
        }
    }
}

/// Text of a hostile file may be quoted: on one line, and a few hundred characters of it.
fn one_line(f: &mut fmt::Formatter<'_>, text: &str) -> fmt::Result {
    const MOST: usize = 400;
    for c in text.chars().take(MOST) {
        write!(f, "{}", if c.is_control() { '\u{fffd}' } else { c })?;
    }
    if text.chars().nth(MOST).is_some() { f.write_str("…") } else { Ok(()) }
}

impl std::error::Error for FormatError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            Self::Invalid { .. } | Self::NotSupported { .. } => None,
        }
    }
}

/// Text of a file as it may appear in a message: control characters replaced, at most 60
/// characters.
pub fn quoted(text: impl AsRef<[u8]>) -> String {
    let text = String::from_utf8_lossy(text.as_ref());
    let mut short: String =
        text.chars().take(60).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    format!("\"{short}\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_names_cause_place_path_and_remedy() {
        let error = FormatError::invalid("a b.ply", "header line 3", "no \n such type")
            .with_remedy("write it again");
        let text = error.to_string();
        assert_eq!(text, "no \u{fffd} such type (header line 3): a b.ply\nhelp: write it again");
        assert_eq!(FormatError::not_supported("x", "", "no").to_string(), "no: x");
    }

    #[test]
    fn a_message_does_not_echo_a_file() {
        let long = "x".repeat(10_000);
        let text = FormatError::invalid("a", long.clone(), long).to_string();
        assert!(text.chars().count() < 1000, "{}", text.len());
    }

    #[test]
    fn an_early_end_is_the_fault_of_the_file() {
        let eof = io::Error::from(io::ErrorKind::UnexpectedEof);
        assert!(matches!(FormatError::io("x", eof), FormatError::Invalid { .. }));
        let missing = io::Error::from(io::ErrorKind::NotFound);
        assert!(matches!(FormatError::io("x", missing), FormatError::Io { .. }));
    }

    #[test]
    fn quotes_are_short_and_printable() {
        assert_eq!(quoted("a\tb"), "\"a\u{fffd}b\"");
        assert_eq!(quoted(vec![b'x'; 1000]).chars().count(), 63);
    }
}
