//! What the command line may say about a fit that a checkpoint continues: nothing that the checkpoint says otherwise.

use std::path::Path;

use clap::{Args as _, FromArgMatches as _};
use motes_stage::StageError;
use serde_json::{Map, Value};

use super::checkpoint::Checkpoint;
use crate::FitOptions;

/// Refuses flags that were given and differ from the checkpoint's: they would have no effect.
///
/// # Errors
/// The first such flags.
pub(super) fn agrees(
    line: &FitOptions,
    seed: u64,
    checkpoint: &Checkpoint,
    path: &Path,
) -> Result<(), StageError> {
    let own = &checkpoint.options;
    let [line, own, usual] = [keys(line), keys(own), keys(&usual())];
    let none = Value::Null;
    let differs = |key: &&String| {
        let [line, own, usual] = [&line, &own, &usual].map(|keys| keys.get(*key).unwrap_or(&none));
        line != usual && line != own
    };
    let mut told: Vec<String> = line
        .keys()
        .filter(differs)
        .map(|key| {
            let [here, there] = [&line, &own].map(|keys| keys.get(key).unwrap_or(&none));
            let there = if there.is_null() { "not set".to_owned() } else { there.to_string() };
            format!("--{key} is {here} here and {there} there")
        })
        .collect();
    if seed != 0 && seed != checkpoint.seed {
        told.push(format!("--seed is {seed} here and {} there", checkpoint.seed));
    }
    if told.is_empty() {
        return Ok(());
    }
    let text = format!(
        "a checkpoint is continued with its own options: {}: {}",
        told.join(", "),
        path.display()
    );
    Err(StageError::usage(text).help(
        "leave these flags out; to go on with others, let it finish and start from its model with --init-ply",
    ))
}

/// Options of an empty command line.
fn usual() -> FitOptions {
    let command = FitOptions::augment_args(clap::Command::new("train-splat"));
    let matches = command.try_get_matches_from(["train-splat"]);
    matches.and_then(|m| FitOptions::from_arg_matches(&m)).unwrap_or_default()
}

/// Flags and values.
fn keys(options: &FitOptions) -> Map<String, Value> {
    match serde_json::to_value(options) {
        Ok(Value::Object(keys)) => keys,
        _ => Map::new(),
    }
}
