//! Short functions: a reader holds one on a screen.

use crate::problem::Problem;
use crate::sources::Source;

const LONG: usize = 80;
/// On the line above a longer function, with the reason.
const MARK: &str = "tidy: long";

pub(super) fn check(source: &Source) -> Vec<Problem> {
    let is_test = |path: &str| path.contains("/tests") || path.ends_with("_tests.rs");
    if !source.path.ends_with(".rs") || is_test(&source.path) {
        return Vec::new();
    }
    let lines: Vec<&str> = source.text.lines().collect();
    let tests = lines.iter().position(|line| *line == "mod tests {").unwrap_or(lines.len());
    let mut problems = Vec::new();
    for (start, line) in lines[..tests].iter().enumerate().filter(|(_, line)| is_function(line)) {
        let indent = line.len() - line.trim_start().len();
        // rustfmt closes a function in the column where it begins.
        let closes = |line: &str| line.trim_end() == format!("{}}}", " ".repeat(indent));
        let Some(length) = lines[start..].iter().position(|line| closes(line)) else { continue };
        let above = lines[start.saturating_sub(4)..start].iter();
        if length + 1 > LONG && !above.clone().any(|line| line.contains(MARK)) {
            let text = format!("a function of {} lines, more than {LONG}: split it", length + 1);
            problems.push(Problem::error(&source.path, start + 1, text));
        }
    }
    problems
}

fn is_function(line: &str) -> bool {
    let words = line.trim_start();
    let ends_here = words.ends_with('}') || words.ends_with(';');
    let words = words.strip_prefix("pub").map_or(words, |rest| {
        rest.trim_start_matches(|c: char| "(crate)superin ::_".contains(c)).trim_start()
    });
    let words =
        ["const ", "async ", "unsafe "].iter().fold(words, |w, p| w.strip_prefix(p).unwrap_or(w));
    words.starts_with("fn ") && !ends_here
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(path: &str, head: &str, lines: usize) -> usize {
        let text = format!(
            "{head}pub(crate) fn long(\n    a: u32,\n) {{\n{}}}\n",
            "    x();\n".repeat(lines)
        );
        check(&Source { path: path.into(), text }).len()
    }

    #[test]
    fn functions_of_more_than_80_lines_fail() {
        assert_eq!(problems("crates/a/src/b.rs", "", 76), 0);
        assert_eq!(problems("crates/a/src/b.rs", "", 77), 1);
    }

    #[test]
    fn tests_and_functions_with_a_reason_may_be_longer() {
        assert_eq!(problems("crates/a/tests/b.rs", "", 100), 0);
        assert_eq!(problems("crates/a/src/b/tests.rs", "", 100), 0);
        assert_eq!(problems("crates/a/src/b.rs", "// tidy: long (a table of cases)\n", 100), 0);
    }

    #[test]
    fn methods_count_too() {
        let body = "        x();\n".repeat(90);
        let text = format!("impl A {{\n    fn long(&self) {{\n{body}    }}\n}}\n");
        assert_eq!(check(&Source { path: "crates/a/src/b.rs".into(), text }).len(), 1);
    }
}
