//! Paths that pages name exist: `crates/scene/src/camera/`. Records keep the names of their day.

use super::links::Places;
use super::vocabulary::is_page;
use crate::problem::Problem;
use crate::sources::Source;

const FOLDERS: [&str; 5] = ["crates/", "tools/", "scripts/", "testdata/", "pipelines/"];

pub(super) fn check(source: &Source, places: &dyn Places) -> Vec<Problem> {
    if !is_page(&source.path) {
        return Vec::new();
    }
    let mut problems = Vec::new();
    for (i, line) in source.text.lines().enumerate() {
        let spans = line.split('`').skip(1).step_by(2);
        for path in spans.flat_map(str::split_whitespace) {
            if is_path(path) && !places.exists(path.trim_end_matches('/')) {
                let text = format!("there is no {path}");
                problems.push(Problem::error(&source.path, i + 1, text));
            }
        }
    }
    problems
}

/// A path of the repository, without places to fill in such as `STAGE` or `<stage>`.
fn is_path(word: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
    let to_fill_in = |part: &str| part.len() > 1 && !part.contains(|c: char| c.is_lowercase());
    FOLDERS.iter().any(|folder| word.starts_with(folder))
        && word.chars().all(plain)
        && !word.split('/').any(to_fill_in)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Known;

    impl Places for Known {
        fn exists(&self, path: &str) -> bool {
            path == "crates/a/src"
        }

        fn page(&self, _: &str) -> Option<&str> {
            None
        }
    }

    #[test]
    fn named_paths_exist() {
        let text =
            "`crates/a/src/` `crates/STAGE/src` `crates/<stage>/x`\n`python3 scripts/no.py`\n";
        let lines = |path: &str| {
            let source = Source { path: path.into(), text: text.into() };
            check(&source, &Known).iter().map(|p| p.line).collect::<Vec<_>>()
        };
        assert_eq!(lines("docs/a.md"), [2]);
        assert!(lines("docs/benchmarks/a.md").is_empty());
    }
}
