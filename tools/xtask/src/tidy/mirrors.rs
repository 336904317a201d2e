//! A list of words has one definition: two enums of unit variants with the same names are one.

use std::collections::BTreeMap;

use crate::problem::Problem;
use crate::sources::Source;

/// Enums of one word, or of none, are no list.
const LEAST_WORDS: usize = 2;

/// All sources together, since the two are in different files.
pub(super) fn check(sources: &[Source]) -> Vec<Problem> {
    let mut first: BTreeMap<Vec<String>, String> = BTreeMap::new();
    let mut problems = Vec::new();
    for source in sources.iter().filter(|s| is_production(&s.path)) {
        for (line, name, words) in enums(&source.text) {
            let place = format!("{name} ({}:{line})", source.path);
            match first.get(&words) {
                Some(other) => problems.push(Problem::error(
                    &source.path,
                    line,
                    format!("{name} has the words of {other}: keep one, in the lower crate"),
                )),
                None => {
                    first.insert(words, place);
                }
            }
        }
    }
    problems
}

fn is_production(path: &str) -> bool {
    path.starts_with("crates/") && path.contains("/src/") && path.ends_with(".rs")
}

/// Line, name and sorted variants, in lower case, of every enum whose variants hold nothing.
fn enums(text: &str) -> Vec<(usize, String, Vec<String>)> {
    let mut found = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        let declared =
            line.trim_start().trim_start_matches(|c: char| c != 'e').strip_prefix("enum ");
        let visible =
            line.trim_start().starts_with("enum ") || line.trim_start().starts_with("pub");
        let Some(declared) = declared.filter(|d| visible && d.ends_with('{')) else { continue };
        let name: String = declared.chars().take_while(|c| c.is_alphanumeric()).collect();
        let end = format!("{}}}", &line[..line.len() - line.trim_start().len()]);
        let body: Vec<&str> = lines.by_ref().map(|(_, l)| l).take_while(|l| *l != end).collect();
        let code =
            body.iter().map(|l| l.trim()).filter(|l| !l.starts_with("//") && !l.starts_with('#'));
        let mut words: Vec<String> = code.map(|l| l.trim_end_matches(',').to_lowercase()).collect();
        words.retain(|word| !word.is_empty());
        if words.len() >= LEAST_WORDS && words.iter().all(|w| w.chars().all(char::is_alphanumeric))
        {
            words.sort();
            found.push((number + 1, name, words));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(path: &str, text: &str) -> Source {
        Source { path: path.into(), text: text.into() }
    }

    #[test]
    fn the_same_words_twice_are_found() {
        let a = source(
            "crates/scene/src/a.rs",
            "/// Doc.\npub enum A {\n    /// One.\n    One,\n    #[x]\n    Two,\n}\n",
        );
        let b = source("crates/edit/src/b.rs", "\nenum B {\n    Two,\n    One,\n}\n");
        let problems = check(&[a, b]);
        assert_eq!(problems.len(), 1);
        assert!(problems[0].text.contains("B has the words of A (crates/scene/src/a.rs:2)"));
    }

    #[test]
    fn other_words_and_values_are_not() {
        let text = "enum A {\n    One,\n    Two,\n}\nenum B {\n    One,\n    Two(f32),\n}\nenum C {\n    One,\n}\n";
        let again = source(
            "crates/b/src/b.rs",
            "enum D {\n    One,\n    Two,\n    Three,\n}\nenum E {\n    One,\n}\n",
        );
        assert_eq!(check(&[source("crates/a/src/a.rs", text), again]), []);
        let test = source("crates/a/tests/t.rs", "enum T {\n    One,\n    Two,\n}\n");
        assert_eq!(check(&[source("crates/a/src/a.rs", text), test]), []);
    }
}
