//! The help of the built stages: flags that the manuals name exist, and words that the glossary
//! refuses are absent.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use anyhow::{bail, ensure};

use crate::generate::{built_providers, built_stages};
use crate::sources::sources;
use crate::tidy::{prose, vocabulary};

const MANUALS: &str = "docs/stages/";
/// Providers in Python declare their flags as quoted words; most need packages to run, so their sources are read.
const SCRIPTS: &str = "scripts/providers/";
/// Programs of one stage that have a help of their own.
const SUBJECTS: [(&str, &[&str]); 2] = [("report", &["lab", "relight"]), ("provider", &["check"])];

pub(crate) fn run(root: &Path) -> anyhow::Result<()> {
    let mut known = BTreeSet::new();
    for (_, help) in helps(root)? {
        known.extend(flags(&help).map(str::to_owned));
    }
    let sources = sources(root)?;
    let is_script = |path: &str| path.starts_with(SCRIPTS) && path.ends_with(".py");
    for script in sources.iter().filter(|s| is_script(&s.path)) {
        known.extend(declared(&script.text).map(str::to_owned));
    }
    let mut problems = 0;
    for page in sources.iter().filter(|s| s.path.starts_with(MANUALS)) {
        for (line, flag) in unknown(&page.text, &known) {
            crate::say(&format!("{}:{line}: no stage has the flag {flag}", page.path));
            problems += 1;
        }
    }
    if problems > 0 {
        bail!("{problems} problems");
    }
    crate::say(&format!("manuals: all flags are among the {} of the stages", known.len()));
    Ok(())
}

/// Words in the help of the built stages that the glossary refuses.
pub(crate) fn help_words(root: &Path) -> anyhow::Result<()> {
    let glossary = std::fs::read_to_string(root.join(vocabulary::FILE))?;
    let rules = match vocabulary::rules(&glossary) {
        Ok(rules) => rules,
        Err(problem) => bail!("{problem}"),
    };
    let mut problems = 0;
    for (stage, help) in helps(root)? {
        for (line, rule) in vocabulary::find(&prose::words(&help), &rules) {
            crate::say(&format!("{stage} --help, line {line}: {rule}"));
            problems += 1;
        }
    }
    if problems > 0 {
        bail!("{problems} problems");
    }
    crate::say("help: no word that the glossary refuses");
    Ok(())
}

/// Words that call a program, and its help.
fn helps(root: &Path) -> anyhow::Result<Vec<(String, String)>> {
    let mut helps = Vec::new();
    for stage in built_stages(root)?.into_iter().chain(built_providers(root)?) {
        let name = stage.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let subjects = SUBJECTS.iter().find(|(stage, _)| *stage == name).map(|(_, s)| *s);
        let calls = subjects.map_or(vec![vec![]], |s| s.iter().map(|s| vec![*s]).collect());
        for words in calls {
            let shown = [&[name.as_str()], words.as_slice()].concat().join(" ");
            let output = Command::new(&stage).args(&words).arg("--help").output()?;
            ensure!(output.status.success(), "no help from {shown}");
            helps.push((shown, String::from_utf8_lossy(&output.stdout).into_owned()));
        }
    }
    Ok(helps)
}

/// Flags of a manual that no stage has, with their lines. `--lr-*` stands for some that begin so;
/// lines that call a script are the script's.
fn unknown<'a>(manual: &'a str, known: &BTreeSet<String>) -> Vec<(usize, &'a str)> {
    let lines = manual.lines().enumerate().filter(|(_, line)| !line.starts_with("python3 "));
    lines
        .flat_map(|(i, line)| flags(line).map(move |flag| (i + 1, flag)))
        .filter(|(_, flag)| match flag.strip_suffix('-') {
            Some(_) => !known.iter().any(|k| k.starts_with(flag)),
            None => !known.contains(*flag),
        })
        .collect()
}

/// Flags that a Python program declares: `add("--steps", ...)`.
fn declared(script: &str) -> impl Iterator<Item = &str> {
    script.split('"').filter(|quoted| flags(quoted).any(|flag| flag == *quoted))
}

/// Words such as `--test-every`.
fn flags(text: &str) -> impl Iterator<Item = &str> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '-';
    text.split(move |c| !is_part(c)).filter(|word| {
        let name = word.strip_prefix("--").unwrap_or_default();
        name.starts_with(|c: char| c.is_ascii_alphabetic())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_that_a_script_declares_are_known() {
        let script = r#"add("--steps", type=int, help="steps (--steps 5)"); say("--not here")"#;
        assert_eq!(declared(script).collect::<Vec<_>>(), ["--steps"]);
    }

    #[test]
    fn flags_that_no_stage_has_are_found() {
        let help = "  -o, --output <PATH>\n      --lr-means <X>\n      --no-cache\n";
        let known = flags(help).map(str::to_owned).collect();
        let manual =
            "`-o`, `--output FILE`, `--lr-*`\n--- | `--outputs`\npython3 x --net\n`--ls-*`";
        assert_eq!(unknown(manual, &known), [(2, "--outputs"), (4, "--ls-")]);
    }
}
