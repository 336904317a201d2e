//! Errors that carry an exit code, and how any error becomes a message.

use std::fmt;

use motes_formats::FormatError;

use crate::ExitStatus;

/// The text of an error and, when there is one, the remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Explanation {
    /// Cause first, path last; no trailing full stop.
    pub text: String,
    /// What the user can do about it.
    pub help: Option<String>,
}

impl From<String> for Explanation {
    /// Errors of libraries carry their remedy after a line break and `help: `.
    fn from(said: String) -> Self {
        match said.split_once("\nhelp: ") {
            Some((text, help)) => Self { text: text.into(), help: Some(help.into()) },
            None => Self { text: said, help: None },
        }
    }
}

/// An error whose kind decides the exit code of the stage. Anything else that reaches the top
/// exits with [`ExitStatus::Failed`], except a [`FormatError`] about the input itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StageError {
    /// The command line asks for something impossible, or an output exists already. Exit code 2.
    Usage(Explanation),
    /// An input is missing, malformed or not supported. Exit code 3.
    BadInput(Explanation),
    /// The stage ran, and its result misses a bound that the user set. Exit code 4.
    GateNotMet(Explanation),
    /// The user stopped the stage. Exit code 130.
    Interrupted(Explanation),
}

impl StageError {
    /// A usage error. Here and below, `text` may carry its remedy after a line break and `help: `.
    pub fn usage(text: impl Into<String>) -> Self {
        Self::Usage(Explanation::from(text.into()))
    }

    /// Bad input data.
    pub fn bad_input(text: impl Into<String>) -> Self {
        Self::BadInput(Explanation::from(text.into()))
    }

    /// A bound that the result misses.
    pub fn gate_not_met(text: impl Into<String>) -> Self {
        Self::GateNotMet(Explanation::from(text.into()))
    }

    /// The user asked to stop; `text` says what was saved.
    pub fn interrupted(text: impl Into<String>) -> Self {
        Self::Interrupted(Explanation::from(text.into()))
    }

    /// The same error with a remedy, shown on a line of its own.
    #[must_use]
    pub fn help(mut self, remedy: impl Into<String>) -> Self {
        let (Self::Usage(e) | Self::BadInput(e) | Self::GateNotMet(e) | Self::Interrupted(e)) =
            &mut self;
        e.help = Some(remedy.into());
        self
    }

    /// The exit code of this kind.
    pub fn status(&self) -> ExitStatus {
        match self {
            Self::Usage(_) => ExitStatus::Usage,
            Self::BadInput(_) => ExitStatus::BadInput,
            Self::GateNotMet(_) => ExitStatus::GateNotMet,
            Self::Interrupted(_) => ExitStatus::Interrupted,
        }
    }
}

impl fmt::Display for StageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Usage(e) | Self::BadInput(e) | Self::GateNotMet(e) | Self::Interrupted(e)) =
            self;
        f.write_str(&e.text)?;
        if let Some(help) = &e.help {
            write!(f, "\nhelp: {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for StageError {}

/// Marks the failure of a library call as the fault of the input (exit code 3). Errors of L3
/// crates need this: `stage` may not know their types.
pub trait OrBadInput<T> {
    /// Turns any error into [`StageError::BadInput`] with the same words.
    fn or_bad_input(self) -> anyhow::Result<T>;
}

impl<T, E: Into<anyhow::Error>> OrBadInput<T> for Result<T, E> {
    fn or_bad_input(self) -> anyhow::Result<T> {
        self.map_err(|error| {
            let Explanation { text, help } = explain(&error.into());
            StageError::BadInput(Explanation { text, help }).into()
        })
    }
}

/// Joins a chain of causes into one line and collects the remedies.
///
/// A cause that the message above it already quotes is not repeated.
pub(crate) fn explain(error: &anyhow::Error) -> Explanation {
    let mut text = String::new();
    let mut remedies = Vec::new();
    for cause in error.chain() {
        let words = cause.to_string();
        let mut lines = words.lines();
        let first = lines.next().unwrap_or_default();
        let mut message = first.to_owned();
        for line in lines {
            match line.strip_prefix("help:") {
                Some(help) => remedies.push(help.trim().to_owned()),
                None => message.push_str(&format!("\n{line}")),
            }
        }
        if text.is_empty() {
            text = message;
        } else if !text.contains(&message) {
            text = format!("{text}: {message}");
        }
    }
    remedies.dedup();
    let help = if remedies.is_empty() { None } else { Some(remedies.join("\nhelp: ")) };
    Explanation { text, help }
}

/// What [`crate::main`] would say about an error, and the exit code that it stands for: for programs that answer in another way
/// than by ending.
pub fn outcome_of(error: &anyhow::Error) -> (Explanation, ExitStatus) {
    (explain(error), status_of(error))
}

/// The exit code that an error stands for.
pub(crate) fn status_of(error: &anyhow::Error) -> ExitStatus {
    for cause in error.chain() {
        if let Some(stage) = cause.downcast_ref::<StageError>() {
            return stage.status();
        }
        if let Some(format) = cause.downcast_ref::<FormatError>() {
            return status_of_format(format);
        }
    }
    ExitStatus::Failed
}

fn status_of_format(error: &FormatError) -> ExitStatus {
    match error {
        FormatError::Invalid { .. } | FormatError::NotSupported { .. } => ExitStatus::BadInput,
        // Only reading meets NotFound: outputs pass `Context::output`, which makes their folder.
        FormatError::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
            ExitStatus::BadInput
        }
        // It was free when it was claimed: another program was quicker.
        FormatError::Io { source, .. } if source.kind() == std::io::ErrorKind::AlreadyExists => {
            ExitStatus::Usage
        }
        FormatError::Io { .. } => ExitStatus::Failed,
    }
}

#[cfg(test)]
mod tests {
    use anyhow::Context as _;

    use super::*;

    #[test]
    fn kinds_map_to_their_codes() {
        for (error, code) in [
            (StageError::usage("a"), 2),
            (StageError::bad_input("a"), 3),
            (StageError::gate_not_met("a"), 4),
            (StageError::interrupted("a"), 130),
        ] {
            let wrapped = anyhow::Error::from(error).context("while doing b");
            assert_eq!(status_of(&wrapped) as u8, code);
        }
        assert_eq!(status_of(&anyhow::anyhow!("plain")), ExitStatus::Failed);
    }

    #[test]
    fn errors_of_files_map_by_whose_fault_they_are() {
        let io = |kind| FormatError::io("a.ply", std::io::Error::from(kind));
        let invalid = FormatError::invalid("a.ply", "line 3", "no end").with_remedy("export again");
        assert_eq!(explain(&anyhow::Error::from(invalid)).help.as_deref(), Some("export again"));
        for (error, status) in [
            (FormatError::invalid("a.ply", "line 3", "no end"), ExitStatus::BadInput),
            (FormatError::not_supported("a.ply", "", "version 9"), ExitStatus::BadInput),
            (io(std::io::ErrorKind::NotFound), ExitStatus::BadInput),
            (io(std::io::ErrorKind::StorageFull), ExitStatus::Failed),
            (io(std::io::ErrorKind::AlreadyExists), ExitStatus::Usage),
        ] {
            assert_eq!(status_of(&anyhow::Error::from(error).context("reading")), status);
        }
    }

    #[test]
    fn causes_are_joined_once_and_help_comes_last() {
        let inner = StageError::bad_input("header ends early: a.ply").help("export it again");
        let error = anyhow::Error::from(inner).context("cannot read Gaussians");
        let explanation = explain(&error);
        assert_eq!(explanation.text, "cannot read Gaussians: header ends early: a.ply");
        assert_eq!(explanation.help.as_deref(), Some("export it again"));

        let quoted = Err::<(), _>(std::io::Error::other("disk full"))
            .context("cannot write (disk full): a.ply")
            .unwrap_err();
        assert_eq!(explain(&quoted).text, "cannot write (disk full): a.ply");
    }

    #[test]
    fn or_bad_input_keeps_the_words() {
        let error = Err::<(), _>(std::io::Error::other("no overlap")).or_bad_input().unwrap_err();
        assert_eq!(status_of(&error), ExitStatus::BadInput);
        assert_eq!(explain(&error).text, "no overlap");
    }
}
