//! Tables of pages render: every row has as many cells as the head, and a head has its rule.

use crate::problem::Problem;
use crate::sources::Source;

pub(super) fn check(source: &Source) -> Vec<Problem> {
    if !source.path.ends_with(".md") {
        return Vec::new();
    }
    let mut problems = Vec::new();
    let mut in_block = false;
    // Cells of the head of the table, and the rows seen so far.
    let mut table: Option<(usize, usize)> = None;
    for (i, line) in source.text.lines().enumerate() {
        let row = line.trim();
        in_block ^= row.starts_with("```");
        if in_block || !row.starts_with('|') {
            table = None;
            continue;
        }
        let (head, rows) = *table.get_or_insert((cells(row), 0));
        table = Some((head, rows + 1));
        if cells(row) != head {
            let text = format!("{} cells in a table of {head}: write \\| inside one", cells(row));
            problems.push(Problem::error(&source.path, i + 1, text));
        } else if rows == 1 && !row.chars().all(|c| "|-: ".contains(c)) {
            problems.push(Problem::error(
                &source.path,
                i + 1,
                "the table has no |---| under its head",
            ));
        }
    }
    problems
}

fn cells(row: &str) -> usize {
    let pipes = row.replace("\\|", "").matches('|').count();
    pipes.saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<usize> {
        let source = Source { path: "docs/a.md".into(), text: text.into() };
        check(&source).into_iter().map(|problem| problem.line).collect()
    }

    #[test]
    fn rows_have_the_cells_of_the_head() {
        assert!(lines("| a | b |\n|---|---|\n| `x \\| y` | z |\n\n| c |\n|---|\n").is_empty());
        assert_eq!(lines("| a | b |\n|---|---|\n| `x | y` | z |\n"), [3]);
    }

    #[test]
    fn a_table_has_a_head() {
        assert_eq!(lines("| a |\n|---|\n| b |\n\n| c |\n| d |\n"), [6]);
        assert!(lines("```\n| c |\n| d | e |\n```\n").is_empty());
    }
}
