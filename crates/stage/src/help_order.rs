//! Order of the groups of flags in `--help`: those for experts come last.

use clap::builder::StyledStr;
use clap::{Arg, Command};

/// The heading of a group of expert flags ends in this.
const EXPERT: &str = "(expert)";

/// Moves groups of expert flags behind all others, and keeps the order otherwise. clap shows the
/// groups in the order of their first arguments, so the command is made again from its parts:
/// name, texts, arguments and argument groups are all that the commands of stages have.
pub(crate) fn experts_last(command: Command) -> Command {
    let arguments = command.get_arguments().cloned();
    let (experts, others): (Vec<Arg>, Vec<Arg>) = arguments.partition(is_expert);
    if experts.is_empty() {
        return command;
    }
    // clap keeps names for the life of the process; there is one command in it.
    let name: &'static str = Box::leak(command.get_name().to_owned().into_boxed_str());
    let mut sorted =
        Command::new(name).args(others).args(experts).groups(command.get_groups().cloned());
    for (text, set) in [
        (command.get_about(), Command::about as fn(Command, StyledStr) -> Command),
        (command.get_long_about(), Command::long_about),
        (command.get_after_help(), Command::after_help),
        (command.get_after_long_help(), Command::after_long_help),
    ] {
        if let Some(text) = text {
            sorted = set(sorted, text.clone());
        }
    }
    sorted
}

fn is_expert(argument: &Arg) -> bool {
    argument.get_help_heading().is_some_and(|heading| heading.ends_with(EXPERT))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ArgGroup;

    fn stage() -> Command {
        let flag = |name: &'static str, heading: &'static str| {
            Arg::new(name).long(name).num_args(1).help_heading(heading)
        };
        Command::new("count")
            .about("Count lines")
            .after_help("Examples:\n  count a.txt")
            .arg(flag("window", "Filter (expert)").requires("lines"))
            .arg(flag("lines", "Model"))
            .arg(flag("words", "Model"))
            .group(ArgGroup::new("one").args(["lines", "words"]))
    }

    #[test]
    fn expert_groups_come_last_and_texts_stay() {
        let help = experts_last(stage()).render_long_help().to_string();
        let place = |text: &str| help.find(text).unwrap_or_else(|| panic!("{text}: {help}"));
        assert!(place("Count lines") < place("Model:"), "{help}");
        assert!(place("Model:") < place("Filter (expert):"), "{help}");
        assert!(place("Filter (expert):") < place("Examples:"), "{help}");
    }

    #[test]
    fn rules_between_arguments_stay() {
        let parse = |line: &str| experts_last(stage()).try_get_matches_from(line.split(' '));
        assert!(parse("count --lines 1 --window 2").is_ok());
        assert!(parse("count --window 2").is_err());
        assert!(parse("count --lines 1 --words 2").is_err());
    }
}
