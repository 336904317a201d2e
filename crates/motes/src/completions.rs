//! Shell completions of `motes STAGE ...`, made of those that each stage prints about itself.

use std::process::{Command, Stdio};

use crate::catalog::{self, Stage};
use crate::find::Finder;

/// Words of the dispatcher itself.
const OWN_WORDS: [&str; 4] = ["help", "which", "list", "completions"];

/// The script for a shell; none when the shell is not known.
pub(crate) fn script(finder: &Finder, shell: &str) -> Option<String> {
    let dispatcher = match shell {
        "bash" => BASH,
        "zsh" => ZSH,
        "fish" => FISH,
        _ => return None,
    };
    let stages = catalog::available(finder);
    let names: Vec<&str> =
        stages.iter().map(|stage| stage.name.as_str()).chain(OWN_WORDS).collect();
    let mut script = if shell == "zsh" { "#compdef motes\n".to_owned() } else { String::new() };
    for stage in &stages {
        let own = own_script(finder, stage, shell).unwrap_or_default();
        script += &match shell {
            // Fish completes by command and condition: the stage becomes a condition.
            "fish" => own.replace(
                &format!("complete -c motes-{}", stage.name),
                &format!("complete -c motes -n '__fish_seen_subcommand_from {}'", stage.name),
            ),
            _ => own,
        };
    }
    Some(script + &dispatcher.replace("@NAMES@", &names.join(" ")))
}

/// What a stage of the suite prints. Programs of third parties are not run for it: they may know no such flag.
fn own_script(finder: &Finder, stage: &Stage, shell: &str) -> Option<String> {
    if !catalog::is_known(&stage.name) {
        return None;
    }
    let mut command = Command::new(finder.find(&stage.name)?);
    command.args(["--generate", shell]).env("MOTES_INVOKED_AS", format!("motes {}", stage.name));
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    let text = String::from_utf8(output.stdout).ok().filter(|_| output.status.success())?;
    // A file of zsh has one such line, the first.
    Some(
        text.lines()
            .filter(|line| !line.starts_with("#compdef"))
            .map(|line| line.to_owned() + "\n")
            .collect(),
    )
}

/// The stage's function sees the line without the word `motes`.
const BASH: &str = r#"
_motes() {
    local words="@NAMES@"
    if [ "$COMP_CWORD" -eq 1 ]; then
        COMPREPLY=($(compgen -W "$words" -- "$2"))
    elif [ "$COMP_CWORD" -eq 2 ] && { [ "${COMP_WORDS[1]}" = help ] || [ "${COMP_WORDS[1]}" = which ]; }; then
        COMPREPLY=($(compgen -W "$words" -- "$2"))
    else
        local stage="${COMP_WORDS[1]}"
        local own="_motes__${stage//-/__}"
        if declare -F "$own" >/dev/null; then
            COMP_WORDS=("${COMP_WORDS[@]:1}")
            COMP_CWORD=$((COMP_CWORD - 1))
            "$own" "$stage" "$2" "$3"
        fi
    fi
}
complete -F _motes -o bashdefault -o default motes
"#;

const ZSH: &str = r#"
_motes() {
    local -a stages=(@NAMES@)
    if (( CURRENT == 2 )) || [[ $CURRENT -eq 3 && ($words[2] == help || $words[2] == which) ]]; then
        compadd -a stages
    elif (( $+functions[_motes-$words[2]] )); then
        local stage="$words[2]"
        shift words
        (( CURRENT-- ))
        _motes-$stage "$@"
    else
        _files
    fi
}
if [ "$funcstack[1]" = "_motes" ]; then
    _motes "$@"
else
    compdef _motes motes
fi
"#;

const FISH: &str = r#"
complete -c motes -n 'not __fish_seen_subcommand_from @NAMES@' -f -a '@NAMES@'
complete -c motes -n '__fish_seen_subcommand_from help which' -f -a '@NAMES@'
"#;
