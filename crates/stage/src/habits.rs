//! Flags as users of other programs spell them.
//!
//! A flag with another name is a clap alias of its option, a value with another name an alias of the value. Here is what
//! clap has no words for: underscores for hyphens, and a flag that stands for a flag with a value.

use std::ffi::OsString;

use clap::{Arg, Command};

/// A flag of another program, and the flag with its value that it means: `("random-bkgd", "background=random")`.
pub type Habit = (&'static str, &'static str);

/// The line in our spelling. Words behind `--` and what we know already stay as they are.
pub(crate) fn spelled(
    command: &Command,
    arguments: &[OsString],
    habits: &[Habit],
) -> Vec<OsString> {
    let end = arguments.iter().position(|word| word == "--").unwrap_or(arguments.len());
    let (flags, rest) = arguments.split_at(end);
    let ours = |word: &OsString| {
        let other = word.to_str().and_then(|text| meaning(command, text, habits));
        other.map_or_else(|| word.clone(), OsString::from)
    };
    flags.iter().map(ours).chain(rest.iter().cloned()).collect()
}

fn meaning(command: &Command, word: &str, habits: &[Habit]) -> Option<String> {
    let (name, value) = match word.strip_prefix("--")?.split_once('=') {
        Some((name, value)) => (name, Some(value)),
        None => (word.strip_prefix("--")?, None),
    };
    if is_known(command, name) {
        return None;
    }
    let hyphenated = name.replace('_', "-");
    if let Some((_, flag)) = habits.iter().find(|(other, _)| *other == hyphenated) {
        return value.is_none().then(|| format!("--{flag}"));
    }
    let value = value.map(|value| format!("={value}")).unwrap_or_default();
    is_known(command, &hyphenated).then(|| format!("--{hyphenated}{value}"))
}

fn is_known(command: &Command, name: &str) -> bool {
    command.get_arguments().any(|argument: &Arg| {
        let aliases = argument.get_all_aliases().unwrap_or_default();
        argument.get_long() == Some(name) || aliases.contains(&name)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn underscores_and_flags_for_values_are_understood() {
        let command = Command::new("train-splat").args([
            Arg::new("iterations").long("iterations").alias("max-steps").num_args(1),
            Arg::new("background").long("background").num_args(1),
            Arg::new("odd").long("odd_one").num_args(1),
        ]);
        let habits = [("random-bkgd", "background=random")];
        for (typed, ours) in [
            ("--max_steps 7", "--max-steps 7"),
            ("--max_steps=a_b", "--max-steps=a_b"),
            ("--iterations 7", "--iterations 7"),
            ("--random_bkgd", "--background=random"),
            ("--random-bkgd", "--background=random"),
            ("--random-bkgd=no", "--random-bkgd=no"),
            ("--odd_one 1", "--odd_one 1"),
            ("--no_such 1", "--no_such 1"),
            ("-o a_b --x", "-o a_b --x"),
            ("-- --max_steps", "-- --max_steps"),
        ] {
            let words: Vec<OsString> = typed.split(' ').map(OsString::from).collect();
            let expected: Vec<OsString> = ours.split(' ').map(OsString::from).collect();
            assert_eq!(spelled(&command, &words, &habits), expected, "{typed}");
        }
    }
}
