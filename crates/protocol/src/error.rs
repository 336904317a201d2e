//! Why a provider gives no answer.

use motes_formats::FormatError;
use motes_formats::error::quoted;
use motes_stage::StageError;
use thiserror::Error;

/// Why a provider gives no answer. The text says the cause, and the remedy on a line that starts with `help:`.
#[derive(Debug, Error)]
pub enum ProviderError {
    /// The command line has an open quote or no word.
    #[error(
        "the command line of the provider is empty or has an open quote: {}\nhelp: give a program and its arguments in one word of the shell: --provider 'python3 my-provider.py'",
        quoted(.0)
    )]
    Words(String),
    /// There is no such program.
    #[error(
        "there is no provider {0}\nhelp: give a command, or put the program motes-provider-{0} into a folder of MOTES_STAGE_PATH or PATH"
    )]
    NotFound(String),
    /// It cannot be started.
    #[error("cannot start the provider {program} ({source})\nhelp: check that it may be run")]
    Start {
        /// Its first word.
        program: String,
        /// What the system answered.
        source: std::io::Error,
    },
    /// It said that it cannot.
    #[error("the provider {name} failed on {what} ({status}): {said}")]
    Failed {
        /// Its command.
        name: String,
        /// What it was doing.
        what: &'static str,
        /// How it ended.
        status: String,
        /// The end of its error output, and its own remedy.
        said: String,
    },
    /// It took too long.
    #[error(
        "the provider {name} did not answer within {seconds} s ({what})\nhelp: allow more with --provider-time-limit, or run it by hand with --{flag}"
    )]
    Late {
        /// Its command.
        name: String,
        /// The limit.
        seconds: f64,
        /// What it was doing.
        what: &'static str,
        /// The flag of that.
        flag: &'static str,
    },
    /// It broke the protocol.
    #[error(
        "the provider {name} does not keep the protocol: {cause}\nhelp: motes provider check COMMAND tells what is wrong; docs/formats/provider.md is the protocol"
    )]
    Protocol {
        /// Its command.
        name: String,
        /// What is wrong.
        cause: String,
    },
    /// It does not do what is asked for.
    #[error("the provider {name} {cause}\nhelp: {help}")]
    Unable {
        /// Its command.
        name: String,
        /// What it does not do.
        cause: String,
        /// What does.
        help: String,
    },
    /// The user asked to stop.
    #[error("interrupted")]
    Stopped,
    /// A file cannot be written or read.
    #[error(transparent)]
    File(#[from] FormatError),
}

impl From<ProviderError> for StageError {
    /// Commands that are none are usage errors, programs that are missing or do something else bad input, and what goes wrong in
    /// a provider is bad input, too: it is data from a program that is not ours.
    fn from(error: ProviderError) -> Self {
        let text = error.to_string();
        match error {
            ProviderError::Words(_) => Self::usage(text),
            ProviderError::Stopped => Self::interrupted(text),
            _ => Self::bad_input(text),
        }
    }
}
