//! The flags of stages that ask a provider.

use std::path::{Path, PathBuf};

use clap::Args;
use motes_formats::provider::ProviderKind;
use motes_stage::{Context, StageError};
use serde::Serialize;

use crate::{Provider, ProviderCommand};

/// A provider, how long it may take and where its answers are kept. Flatten it as `CommonArgs`.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Provider (expert)")]
pub struct ProviderFlags {
    /// Program that runs a learned model, with its arguments, or NAME of motes-provider-NAME. Only the command line can say it,
    /// no file
    #[arg(long, value_name = "COMMAND")]
    pub provider: Option<String>,

    /// Longest that one answer of the provider may take, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, value_parser = positive)]
    pub provider_time_limit: f64,

    /// Folder for answers of the provider, which serve again for the same pictures, request and model; "none" keeps no answer [default:
    /// motes/answers in the user's folder of caches]
    #[arg(long, value_name = "DIR")]
    pub provider_cache: Option<PathBuf>,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v > 0.0 && v.is_finite() => Ok(v),
        _ => Err("expected seconds above 0".into()),
    }
}

impl ProviderFlags {
    /// The command that the user typed.
    ///
    /// # Errors
    /// It comes from `--config`: a file names no program to start. It is no command, or there is no such program.
    pub fn command(&self, context: &Context) -> Result<Option<ProviderCommand>, StageError> {
        let Some(command) = &self.provider else { return Ok(None) };
        if context.is_from_config("provider") {
            let text = "a file of --config may not name a program to start: provider";
            return Err(StageError::usage(text).help("type --provider on the command line"));
        }
        Ok(Some(ProviderCommand::new(command)?))
    }

    /// Starts a provider of this kind.
    ///
    /// # Errors
    /// As [`Provider::open`].
    pub fn open(
        &self,
        command: ProviderCommand,
        kind: ProviderKind,
        context: &Context,
    ) -> Result<Provider, StageError> {
        let answers = match &self.provider_cache {
            Some(folder) if folder.as_os_str() == "none" => None,
            Some(folder) => Some(folder.clone()),
            None => user_cache("answers"),
        };
        let stopped = || context.interrupted();
        let answers = answers.as_deref().map(Path::new);
        Ok(Provider::open(command, kind, self.provider_time_limit, answers, &stopped)?)
    }
}

/// `motes/NAME` in the user's folder of caches; none where there is no such folder.
pub fn user_cache(name: &str) -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from);
    let absolute = |folder: &PathBuf| folder.is_absolute();
    let caches = variable("XDG_CACHE_HOME").filter(absolute);
    let caches = caches.or_else(|| Some(variable("HOME").filter(absolute)?.join(".cache")))?;
    Some(caches.join("motes").join(name))
}
