//! `--config FILE`: options from JSON, merged below the flags of the command line.
//!
//! The JSON is turned into flags and parsed by clap like any others, so a config file is
//! validated by the same rules and the same messages, and no stage declares an option twice.
//! Precedence: flag, environment variable, config file, default.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command};
use serde_json::{Map, Value};

use crate::{Preset, StageError};

/// Keys that a config file may not set: they choose what the program is.
const NOT_IN_CONFIG: [&str; 6] =
    ["config", "dump_config", "generate", "summary", "help", "version"];

/// Options that name a program: only the user starts one, a file does not.
const PROGRAMS: [&str; 2] = ["python", "editor"];

/// The config file named on the command line, if any.
pub(crate) fn config_path(arguments: &[OsString]) -> Option<PathBuf> {
    let mut rest = arguments.iter().skip(1);
    while let Some(argument) = rest.next() {
        let Some(text) = argument.to_str() else { continue };
        match text {
            "--" => return None,
            "--config" => return rest.next().map(PathBuf::from),
            _ => {
                if let Some(path) = text.strip_prefix("--config=") {
                    return Some(PathBuf::from(path));
                }
            }
        }
    }
    None
}

/// A command line with the options of a config file inserted before the user's own.
#[derive(Debug, Default)]
pub(crate) struct Merged {
    pub(crate) line: Vec<OsString>,
    /// Ids of the options that the file set.
    pub(crate) from_config: Vec<String>,
}

/// Inserts the options of a config file that the user did not give.
pub(crate) fn merged(
    command: &Command,
    arguments: &[OsString],
    path: &Path,
) -> Result<Merged, StageError> {
    let options = read(path)?;
    // Errors are ignored here (required options may be in the file): the merged line is parsed
    // again, strictly.
    let given = command.clone().ignore_errors(true).try_get_matches_from(arguments).ok();
    let (mut extra, mut from_config) = (Vec::new(), Vec::new());
    for (key, value) in &options {
        let argument = command
            .get_arguments()
            .find(|a| is_called(a, key))
            .filter(|_| !NOT_IN_CONFIG.contains(&key.as_str()))
            .ok_or_else(|| unknown_key(command, key, path))?;
        if !given.as_ref().is_some_and(|matches| is_explicit(matches, argument.get_id().as_str())) {
            if PROGRAMS.contains(&argument.get_id().as_str()) && !value.is_null() {
                return Err(names_a_program(argument.get_id().as_str(), path));
            }
            append(&mut extra, argument, value, path)?;
            from_config.push(argument.get_id().to_string());
        }
    }
    let mut line = vec![arguments.first().cloned().unwrap_or_default()];
    let (flags, positionals): (Vec<_>, Vec<_>) = extra.into_iter().partition(|(flag, _)| *flag);
    line.extend(flags.into_iter().map(|(_, text)| text));
    let user = arguments.get(1..).unwrap_or_default();
    let end = user.iter().position(|a| a == "--").unwrap_or(user.len());
    line.extend_from_slice(&user[..end]);
    if end < user.len() || !positionals.is_empty() {
        line.push("--".into());
        line.extend(positionals.into_iter().map(|(_, text)| text));
        line.extend_from_slice(user.get(end + 1..).unwrap_or_default());
    }
    Ok(Merged { line, from_config })
}

/// Inserts the flags of the preset that a line names, except those that the line gives.
pub(crate) fn with_preset(
    command: &Command,
    line: Vec<OsString>,
    presets: &[Preset],
) -> Vec<OsString> {
    // The line is parsed for stages that have presets only.
    let parsed = || command.clone().ignore_errors(true).try_get_matches_from(&line).ok();
    let Some(given) = (!presets.is_empty()).then(parsed).flatten() else { return line };
    let named = given.get_raw("preset").and_then(Iterator::last).and_then(|name| name.to_str());
    let Some((_, flags)) = presets.iter().find(|(name, _)| Some(*name) == named) else {
        return line;
    };
    let mut words = line.into_iter();
    let mut merged: Vec<OsString> = words.next().into_iter().collect();
    for (flag, value) in *flags {
        let argument = command.get_arguments().find(|a| a.get_long() == Some(flag));
        if !argument.is_some_and(|a| is_explicit(&given, a.get_id().as_str())) {
            merged.push(format!("--{flag}={value}").into());
        }
    }
    merged.extend(words);
    merged
}

/// Whether a key names an argument: by its name, or by one that it had before.
fn is_called(argument: &Arg, key: &str) -> bool {
    let aliases = argument.get_all_aliases().unwrap_or_default();
    argument.get_id() == key || aliases.iter().any(|alias| alias.replace('-', "_") == key)
}

fn is_explicit(matches: &ArgMatches, key: &str) -> bool {
    let known = matches.try_contains_id(key).unwrap_or(false);
    known
        && matches!(
            matches.value_source(key),
            Some(ValueSource::CommandLine | ValueSource::EnvVariable)
        )
}

fn read(path: &Path) -> Result<Map<String, Value>, StageError> {
    let shown = path.display();
    let text = std::fs::read_to_string(path).map_err(|e| {
        StageError::bad_input(format!("cannot read the config file ({e}): {shown}"))
    })?;
    match serde_json::from_str::<Value>(&text) {
        Ok(Value::Object(options)) => {
            let mut flat = Map::new();
            flatten(options, &mut flat);
            Ok(flat)
        }
        Ok(_) => Err(StageError::bad_input(format!("config is not a JSON object: {shown}"))),
        Err(e) => Err(StageError::bad_input(format!("config is not JSON ({e}): {shown}"))),
    }
}

/// Nested option groups and flat ones read the same.
fn flatten(options: Map<String, Value>, flat: &mut Map<String, Value>) {
    for (key, value) in options {
        match value {
            Value::Object(group) => flatten(group, flat),
            value => {
                flat.insert(key.replace('-', "_"), value);
            }
        }
    }
}

fn append(
    extra: &mut Vec<(bool, OsString)>,
    argument: &Arg,
    value: &Value,
    path: &Path,
) -> Result<(), StageError> {
    let values: Vec<&Value> = match value {
        Value::Null => return Ok(()),
        Value::Array(values) => values.iter().collect(),
        value => vec![value],
    };
    let flag = argument.get_long().map(|long| format!("--{long}"));
    let texts = values.into_iter().map(|value| match value {
        Value::String(text) => Ok(text.clone()),
        Value::Number(number) => Ok(number.to_string()),
        Value::Bool(on) => Ok(on.to_string()),
        _ => {
            let (id, shown) = (argument.get_id(), path.display());
            Err(StageError::bad_input(format!("option \"{id}\" is nested: {shown}")))
        }
    });
    let texts = texts.collect::<Result<Vec<String>, StageError>>()?;
    // An option of two values (`--between A B`) is one flag per pair.
    let width = argument.get_num_args().map_or(1, |count| count.min_values());
    if let (Some(flag), true) = (&flag, width > 1) {
        for group in texts.chunks(width) {
            extra.push((true, flag.into()));
            extra.extend(group.iter().map(|text| (true, text.into())));
        }
        return Ok(());
    }
    for text in texts {
        match (argument.get_action(), &flag) {
            (ArgAction::SetTrue, Some(flag)) if text == "true" => {
                extra.push((true, flag.into()));
            }
            (ArgAction::SetTrue, _) if text == "false" => {}
            (ArgAction::Count, Some(flag)) => {
                let times = text.parse::<u8>().map_err(|_| {
                    StageError::bad_input(format!("{flag} needs a count: {}", path.display()))
                })?;
                extra.extend((0..times).map(|_| (true, flag.into())));
            }
            (_, Some(flag)) => extra.push((true, format!("{flag}={text}").into())),
            (_, None) => extra.push((false, text.into())),
        }
    }
    Ok(())
}

fn names_a_program(key: &str, path: &Path) -> StageError {
    let flag = key.replace('_', "-");
    let shown = path.display();
    StageError::bad_input(format!("\"{key}\" names a program, and a file starts none: {shown}"))
        .help(format!("if you trust it, give --{flag} on the command line"))
}

fn unknown_key(command: &Command, key: &str, path: &Path) -> StageError {
    let name = command.get_name();
    StageError::bad_input(format!("{name} has no option \"{key}\": {}", path.display()))
        .help("write one with --dump-config to see the keys")
}

#[cfg(test)]
mod tests;
