//! `--generate`: manual page and shell completions from the same table as `--help`.

use std::io;

use clap::Command;

use crate::common::Generate;

pub(crate) fn text(what: Generate, mut command: Command) -> io::Result<String> {
    use clap_complete::Shell;
    // Called as `motes render` it completes for the dispatcher, whose script names it so.
    let name = command.get_bin_name().unwrap_or(command.get_name()).replace(' ', "-");
    let mut bytes = Vec::new();
    let shell = match what {
        Generate::Man => {
            clap_mangen::Man::new(command).render(&mut bytes)?;
            return String::from_utf8(bytes).map_err(io::Error::other);
        }
        Generate::Bash => Shell::Bash,
        Generate::Zsh => Shell::Zsh,
        Generate::Fish => Shell::Fish,
    };
    clap_complete::generate(shell, &mut command, name, &mut bytes);
    String::from_utf8(bytes).map_err(io::Error::other)
}

/// The value of `--generate` before the line is parsed: required options need not be there.
pub(crate) fn requested(arguments: &[std::ffi::OsString]) -> Option<Generate> {
    let words: Vec<_> = arguments.iter().skip(1).filter_map(|a| a.to_str()).collect();
    let value = match words.as_slice() {
        ["--generate", value] => value,
        [one] => one.strip_prefix("--generate=")?,
        _ => return None,
    };
    clap::ValueEnum::from_str(value, false).ok()
}
