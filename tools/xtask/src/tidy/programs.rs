//! A crate with a program has a test of the program in `tests/`: `cargo test --workspace` builds a program only for
//! such tests, and the tests of the whole suite start all of them.

use crate::problem::Problem;
use crate::sources::Source;

pub(super) fn check(sources: &[Source]) -> Vec<Problem> {
    let programs = sources.iter().filter_map(|s| s.path.strip_suffix("/src/main.rs"));
    let has_tests = |program: &str| {
        let folder = format!("{program}/tests/");
        sources.iter().any(|s| s.path.starts_with(&folder) && s.path.ends_with(".rs"))
    };
    // Crates of tools are built by name.
    let untested = programs.filter(|p| p.starts_with("crates/") && !has_tests(p));
    let text = "has a program and no test of it in tests/: on a clean checkout cargo test does not build it";
    untested.map(|p| Problem::error(format!("{p}/src/main.rs"), 0, text)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(paths: &[&str]) -> usize {
        let source = |path: &&str| Source { path: (*path).to_owned(), text: String::new() };
        check(&paths.iter().map(source).collect::<Vec<_>>()).len()
    }

    #[test]
    fn a_program_needs_a_test_in_its_own_crate() {
        assert_eq!(problems(&["crates/a/src/main.rs"]), 1);
        assert_eq!(problems(&["crates/a/src/main.rs", "crates/ab/tests/cli_a.rs"]), 1);
        assert_eq!(problems(&["crates/a/src/main.rs", "crates/a/tests/cli_a.rs"]), 0);
        assert_eq!(problems(&["tools/a/src/main.rs", "crates/b/src/lib.rs"]), 0);
    }
}
