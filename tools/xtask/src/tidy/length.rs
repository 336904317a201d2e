//! Short files: one concept each.

use crate::problem::Problem;
use crate::sources::Source;

const LONG: usize = 400;
const TOO_LONG: usize = 700;
/// A program is a page.
const LONG_PROGRAM: usize = 60;
const TOO_LONG_PROGRAM: usize = 60;
/// On one of the first lines of a file that is a table of data or of cases.
const TABLE_MARK: &str = "tidy: table";

pub(super) fn check(source: &Source) -> Option<Problem> {
    if !counts(source) || source.text.lines().take(10).any(|line| line.contains(TABLE_MARK)) {
        return None;
    }
    let lines = source.text.lines().count();
    let (long, too_long) =
        if source.path.starts_with("crates/") && source.path.ends_with("/src/main.rs") {
            (LONG_PROGRAM, TOO_LONG_PROGRAM)
        } else {
            (LONG, TOO_LONG)
        };
    let text = format!("{lines} lines, more than {long}: split it");
    match lines {
        n if n > too_long => Some(Problem::error(&source.path, 0, text)),
        n if n > long => Some(Problem::warning(&source.path, 0, text)),
        _ => None,
    }
}

pub(super) fn summary(sources: &[Source]) -> String {
    let mut lines: Vec<usize> =
        sources.iter().filter(|s| counts(s)).map(|s| s.text.lines().count()).collect();
    lines.sort_unstable();
    let at = |share: f64| lines.get((share * (lines.len() as f64 - 1.0)) as usize).copied();
    let (median, p90) = (at(0.5).unwrap_or(0), at(0.9).unwrap_or(0));
    format!("{} files of code, median {median} lines, 90 % at most {p90}", lines.len())
}

fn counts(source: &Source) -> bool {
    source.path.ends_with(".rs") || source.path.ends_with(".py")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fails(path: &str, lines: usize, head: &str) -> Option<bool> {
        let text = head.to_owned() + &"x\n".repeat(lines);
        check(&Source { path: path.into(), text }).map(|problem| problem.fails)
    }

    #[test]
    fn long_files_are_said_and_very_long_ones_fail() {
        assert_eq!(fails("a/b.rs", 400, ""), None);
        assert_eq!(fails("a/b.rs", 401, ""), Some(false));
        assert_eq!(fails("a/b.py", 701, ""), Some(true));
        assert_eq!(fails("a/b.md", 701, ""), None);
        assert_eq!(fails("a/b.rs", 701, "//! tidy: table\n"), None);
    }

    #[test]
    fn a_stage_is_a_page() {
        assert_eq!(fails("crates/render/src/main.rs", 60, ""), None);
        assert_eq!(fails("crates/render/src/main.rs", 61, ""), Some(true));
    }
}
