//! `-h`: the flags that a user needs, and where the others are.

use clap::{Arg, Command};

use crate::common::COMMON_BASIC;

/// Leaves `basic`, the common basic flags and required arguments in `-h`; an empty list leaves all.
pub(crate) fn shorten(command: Command, basic: &[&str]) -> Command {
    if basic.is_empty() {
        return command;
    }
    let is_basic = |arg: &Arg| {
        let long = arg.get_long();
        long.is_none_or(|name| basic.contains(&name) || COMMON_BASIC.contains(&name))
            || arg.is_required_set()
    };
    let hidden = command.get_arguments().filter(|a| !is_basic(a) && !a.is_hide_set()).count();
    let name = command.get_bin_name().unwrap_or(command.get_name()).to_owned();
    let more = format!("{hidden} more options: {name} --help");
    let examples = command.get_after_help().cloned();
    let command = command.mut_args(|arg| {
        let hide = !is_basic(&arg);
        arg.hide_short_help(hide)
    });
    match examples {
        Some(examples) => {
            command.after_help(format!("{more}\n\n{examples}")).after_long_help(examples)
        }
        None => command.after_help(more).after_long_help(""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage() -> Command {
        Command::new("count")
            .arg(Arg::new("file").required(true))
            .arg(Arg::new("lines").long("lines").help("Count lines"))
            .arg(Arg::new("window").long("window").help("Smooth the count"))
    }

    #[test]
    fn short_help_shows_the_basic_flags_and_counts_the_others() {
        let short = shorten(stage(), &["lines"]).render_help().to_string();
        assert!(short.contains("--lines") && !short.contains("--window"), "{short}");
        assert!(short.contains("1 more options: count --help"), "{short}");
    }

    #[test]
    fn long_help_shows_all() {
        let long = shorten(stage(), &["lines"]).render_long_help().to_string();
        assert!(long.contains("--lines") && long.contains("--window"), "{long}");
        assert!(!long.contains("more options"), "{long}");
    }

    #[test]
    fn without_a_list_nothing_is_hidden() {
        let short = shorten(stage(), &[]).render_help().to_string();
        assert!(short.contains("--window"), "{short}");
    }
}
