//! What the Python scripts say on standard output: an event in JSON per line, a result or an error last.

use std::process::Command;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::error::{IngestError, Result};
use crate::files::process::{Line, run};
use crate::progress::Progress;

/// A line of a script whose result is an `R`.
#[derive(Deserialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub(super) enum Event<R> {
    Progress { phase: String, done: usize, total: usize },
    Warning(Warning),
    Result(Box<R>),
    Error { code: String, message: String, remedy: String },
}

/// A doubt that leaves the result usable.
#[derive(Deserialize)]
pub(super) struct Warning {
    pub(super) code: String,
    pub(super) message: String,
}

/// Runs a script to its end and shows its progress: its result and its warnings. `remedy` is the advice for a script
/// that ends without a result.
pub(super) fn listen<R: DeserializeOwned>(
    command: &mut Command,
    progress: &dyn Progress,
    remedy: &str,
) -> Result<(R, Vec<Warning>)> {
    let (mut warnings, mut result, mut error) = (Vec::new(), None, None);
    let mut phase_now = String::new();
    let ended = run(command, progress, &mut |line| {
        let Line::Out(text) = line else { return };
        match serde_json::from_str(text) {
            Ok(Event::Progress { phase, done, total }) => {
                if phase != phase_now {
                    progress.begin(&phase, total);
                    phase_now = phase;
                }
                progress.advance_to(done);
            }
            Ok(Event::Warning(warning)) => warnings.push(warning),
            Ok(Event::Result(found)) => result = Some(*found),
            Ok(Event::Error { code, message, remedy }) => error = Some((code, message, remedy)),
            // A newer script may say more; only an unreadable result matters, and then there is none.
            Err(_) => tracing::debug!("pycolmap: {text}"),
        }
    })?;
    match (result, error) {
        (Some(result), None) if ended.status.success() => Ok((result, warnings)),
        (_, Some((code, message, remedy))) => Err(error_of(&code, message, remedy)),
        _ => {
            let last = ended.last_words.last().cloned().unwrap_or_default();
            Err(IngestError::Failed {
                cause: format!("pycolmap ended without a result ({}): {last}", ended.status),
                remedy: remedy.into(),
            })
        }
    }
}

fn error_of(code: &str, cause: String, remedy: String) -> IngestError {
    match code {
        "bad_usage" => IngestError::Usage { cause, remedy },
        "no_photos" | "too_few_photos" | "bad_photo" | "bad_mask" | "too_few_features"
        | "too_few_matches" | "no_model" => IngestError::BadInput { cause, remedy },
        _ => IngestError::Failed { cause, remedy },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causes_decide_the_kind_of_error() {
        let kind = |code: &str| error_of(code, String::new(), String::new());
        assert!(matches!(kind("too_few_matches"), IngestError::BadInput { .. }));
        assert!(matches!(kind("bad_usage"), IngestError::Usage { .. }));
        assert!(matches!(kind("no_pycolmap"), IngestError::Failed { .. }));
        assert!(matches!(kind("a later code"), IngestError::Failed { .. }));
    }
}
