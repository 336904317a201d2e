//! Whether a program keeps the protocol: it is asked the way stages ask, and the ways that nobody should.

mod cases;
mod inputs;

use std::path::Path;
use std::time::Duration;

use motes_formats::atomic::ScratchFolder;
use motes_formats::provider::{ProviderDescription, ProviderKind};
use serde::Serialize;

use crate::{Provider, ProviderCommand, ProviderError};

pub use inputs::request;

/// What a provider is granted to end when it is asked to.
pub const END: Duration = Duration::from_secs(5);

/// How a check went.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "outcome", content = "cause")]
pub enum Outcome {
    /// As the protocol says.
    Passed,
    /// Otherwise.
    Failed(String),
    /// It says nothing about this provider.
    Skipped(String),
}

/// A check and how it went.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What a provider does that keeps the protocol.
    pub check: &'static str,
    /// How it went.
    #[serde(flatten)]
    pub outcome: Outcome,
}

/// What every check gets.
struct Subject<'a> {
    command: &'a ProviderCommand,
    kind: ProviderKind,
    seconds: f64,
    stopped: &'a dyn Fn() -> bool,
    description: ProviderDescription,
}

type Check = fn(&Subject<'_>, &Path) -> Result<Outcome, ProviderError>;

/// In the order in which they are run.
const CHECKS: [(&str, Check); 7] = [
    ("answers a picture of one pixel", cases::one_pixel),
    ("answers a picture, and says nothing on standard output", cases::picture),
    ("answers the same request alike", cases::alike),
    ("refuses a bad request with exit code 2 and one line", cases::bad_request),
    ("serves what it answers", cases::serves),
    ("serves on after a bad request", cases::serves_on),
    ("ends when it is asked to", cases::ends),
];
const DESCRIBES: &str = "describes itself";

/// Runs all checks of a provider; `seconds` is the limit of each answer.
///
/// # Errors
/// The user asked to stop, or there is no room for pictures. What the provider does wrong is a finding.
pub fn conformance(
    command: &ProviderCommand,
    kind: ProviderKind,
    seconds: f64,
    stopped: &dyn Fn() -> bool,
) -> Result<(Option<ProviderDescription>, Vec<Finding>), ProviderError> {
    let opened = Provider::open(command.clone(), kind, seconds, None, stopped);
    let description = match opened {
        Ok(provider) => provider.description.clone(),
        Err(ProviderError::Stopped) => return Err(ProviderError::Stopped),
        Err(error) => {
            let mut findings = vec![finding(DESCRIBES, failed(&error))];
            let rest = || Outcome::Skipped("it does not describe itself".into());
            findings.extend(CHECKS.iter().map(|(name, _)| finding(name, rest())));
            return Ok((None, findings));
        }
    };
    let mut findings = vec![finding(DESCRIBES, Outcome::Passed)];
    let subject = Subject { command, kind, seconds, stopped, description };
    for (name, check) in CHECKS {
        let scratch = ScratchFolder::new()
            .map_err(|error| motes_formats::FormatError::io("temporary folder", error))?;
        findings.push(finding(
            name,
            match check(&subject, scratch.path()) {
                Ok(outcome) => outcome,
                Err(ProviderError::Stopped) => return Err(ProviderError::Stopped),
                Err(error) => failed(&error),
            },
        ));
    }
    Ok((Some(subject.description), findings))
}

fn finding(check: &'static str, outcome: Outcome) -> Finding {
    Finding { check, outcome }
}

fn failed(error: &ProviderError) -> Outcome {
    let text = error.to_string();
    Outcome::Failed(text.lines().next().unwrap_or_default().to_owned())
}
