//! No bare stage name in command position: `export` is a word of the shell, `edit` often another
//! program. Call `$(BIN)/export` or `motes export`.

use super::shell::{command_words, logical_lines};
use crate::problem::Problem;
use crate::sources::Source;

/// Names of the suite that are reserved before their stage exists.
const RESERVED: [&str; 5] = ["decompose", "relight", "segment-select", "edit", "export"];

pub(super) fn check(source: &Source, stages: &[String]) -> Vec<Problem> {
    let lines: Vec<(usize, String)> = if source.path.ends_with(".md") {
        shell_blocks(&source.text)
    } else if !source.path.starts_with("pipelines/") {
        Vec::new()
    } else if is_makefile(&source.path) {
        let lines = logical_lines(&source.text);
        lines.into_iter().filter(|(_, line)| line.starts_with('\t')).collect()
    } else if source.path.ends_with(".sh") || source.text.starts_with("#!") {
        logical_lines(&source.text)
    } else {
        Vec::new()
    };
    lines.iter().flat_map(|(number, line)| bare(source, *number, line, stages)).collect()
}

fn bare(source: &Source, number: usize, line: &str, stages: &[String]) -> Vec<Problem> {
    command_words(line)
        .into_iter()
        .filter(|c| RESERVED.contains(&c.word) || stages.iter().any(|stage| stage == c.word))
        .filter(|c| !(c.word == "export" && c.next.is_some_and(is_variable)))
        .map(|c| {
            let text = format!("\"{}\" is called bare: write \"motes {0}\" or a path", c.word);
            Problem::error(&source.path, number, text)
        })
        .collect()
}

/// What the `export` of the shell takes, as people write it.
fn is_variable(word: &str) -> bool {
    let name = word.split('=').next().unwrap_or_default();
    !name.is_empty()
        && name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
}

fn is_makefile(path: &str) -> bool {
    let name = path.rsplit('/').next().unwrap_or(path);
    name.starts_with("Makefile") || name.ends_with(".mk")
}

/// Lines of fenced blocks that hold shell commands.
fn shell_blocks(markdown: &str) -> Vec<(usize, String)> {
    let mut fence: Option<bool> = None;
    let mut kept = String::new();
    for line in markdown.lines() {
        let text = match (line.trim_start().strip_prefix("```"), fence) {
            (Some(_), Some(_)) => {
                fence = None;
                ""
            }
            (Some(language), None) => {
                let shells = ["sh", "bash", "shell", "console", "make"];
                fence = Some(shells.contains(&language.trim()));
                ""
            }
            (None, Some(true)) => line.trim_start().strip_prefix("$ ").unwrap_or(line),
            (None, _) => "",
        };
        // Every line is kept, empty or not, so that numbers stay right.
        kept.push_str(text);
        kept.push('\n');
    }
    logical_lines(&kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(path: &str, text: &str) -> Vec<usize> {
        let source = Source { path: path.into(), text: text.into() };
        check(&source, &["render".into()]).into_iter().map(|problem| problem.line).collect()
    }

    #[test]
    fn makefiles_call_stages_by_path() {
        let makefile =
            "export PATH\na: b\n\t$(BIN)/render x\n\t@render x\n\techo a && \\\n\texport b\n";
        assert_eq!(lines("pipelines/lab/Makefile", makefile), [4, 5]);
        assert!(lines("scripts/Makefile", makefile).is_empty());
    }

    #[test]
    fn shell_blocks_of_documents_are_read() {
        let text = "render x\n```sh\nexport A=1\n$ export a.ply\nmotes export a.ply\n```\n```text\nrender x\n```\n";
        assert_eq!(lines("docs/a.md", text), [4]);
    }

    #[test]
    fn scripts_are_read() {
        assert_eq!(lines("pipelines/x/run", "#!/bin/sh\nrender a\n"), [2]);
        assert!(lines("pipelines/x/notes.txt", "render a\n").is_empty());
    }
}
