//! The words that the glossary refuses. The table of `docs/GLOSSARY.md` is the list; `check` reads
//! pages, `find` any text, such as the help of a program.

use std::fmt;

use super::prose::{Word, words_of_markdown};
use crate::problem::Problem;
use crate::sources::Source;

pub(crate) const FILE: &str = "docs/GLOSSARY.md";
const BEGIN: &str = "<!-- words: begin -->";
const END: &str = "<!-- words: end -->";

/// A word or phrase that is not used, and what is written instead.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Rule {
    /// Words of the phrase; a trailing `*` matches any ending.
    phrase: Vec<String>,
    shown: String,
    instead: String,
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{}\" is not a word of ours, write: {}", self.shown, self.instead)
    }
}

/// The rules of the glossary's table.
pub(crate) fn rules(glossary: &str) -> Result<Vec<Rule>, Problem> {
    let table = glossary.split_once(BEGIN).and_then(|(_, rest)| rest.split_once(END));
    let Some((table, _)) = table else {
        return Err(Problem::error(FILE, 0, format!("has no table between {BEGIN} and {END}")));
    };
    let rows = table.lines().filter(|line| line.starts_with('|')).skip(2);
    let rules: Vec<Rule> = rows.filter_map(rule).collect();
    if rules.is_empty() {
        return Err(Problem::error(FILE, 0, "the table of words is empty"));
    }
    Ok(rules)
}

fn rule(row: &str) -> Option<Rule> {
    let mut cells = row.trim_matches('|').split('|').map(str::trim);
    let (shown, instead) = (cells.next()?.to_owned(), cells.next()?.to_owned());
    let phrase = shown.split_whitespace().map(str::to_lowercase).collect();
    Some(Rule { phrase, shown, instead })
}

/// Lines of pages that use a refused word. Benchmark records keep the words of their day.
pub(super) fn check(source: &Source, rules: &[Rule]) -> Vec<Problem> {
    if !is_page(&source.path) {
        return Vec::new();
    }
    let text = match source.path.as_str() {
        FILE => outside_of_table(&source.text),
        _ => source.text.clone(),
    };
    find(&words_of_markdown(&text), rules)
        .into_iter()
        .map(|(line, rule)| Problem::error(&source.path, line, rule.to_string()))
        .collect()
}

/// A page that people read, and that is not a record of measurements.
pub(super) fn is_page(path: &str) -> bool {
    path.ends_with(".md") && !path.starts_with("docs/benchmarks/")
}

/// The rules that words break, with the line.
pub(crate) fn find<'a>(words: &[Word], rules: &'a [Rule]) -> Vec<(usize, &'a Rule)> {
    let mut found = Vec::new();
    for (i, word) in words.iter().enumerate() {
        for rule in rules {
            let here = words.get(i..i + rule.phrase.len()).unwrap_or(&[]);
            if !here.is_empty() && here.iter().zip(&rule.phrase).all(|(w, p)| matches(&w.text, p)) {
                found.push((word.line, rule));
            }
        }
    }
    found
}

fn matches(word: &str, pattern: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(start) => word.starts_with(start),
        None => word == pattern,
    }
}

fn outside_of_table(glossary: &str) -> String {
    let mut inside = false;
    let mut kept = String::new();
    for line in glossary.lines() {
        inside = (inside || line.contains(BEGIN)) && !line.contains(END);
        kept.push_str(if inside { "" } else { line });
        kept.push('\n');
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::super::prose::words;
    use super::*;

    const GLOSSARY: &str = "own light\n<!-- words: begin -->\n| not | but |\n|---|---|\n\
        | own light | capture illumination |\n| colour* | color |\n<!-- words: end -->\n";

    fn lines(path: &str, text: &str) -> Vec<usize> {
        let source = Source { path: path.into(), text: text.into() };
        let rules = rules(GLOSSARY).unwrap();
        check(&source, &rules).into_iter().map(|problem| problem.line).collect()
    }

    #[test]
    fn phrases_are_found_across_line_ends_and_endings() {
        assert_eq!(lines("docs/a.md", "Its own\nlight, and Colours.\n"), [1, 2]);
        assert_eq!(lines("docs/a.md", "`own light` own, light discolored\n"), [0usize; 0]);
    }

    #[test]
    fn records_and_the_table_itself_are_left_alone() {
        assert_eq!(lines("docs/benchmarks/a.md", "colour\n"), [0usize; 0]);
        assert_eq!(lines("src/a.rs", "colour\n"), [0usize; 0]);
        assert_eq!(lines(FILE, GLOSSARY), [1]);
    }

    #[test]
    fn plain_text_can_be_asked_too() {
        let rules = rules(GLOSSARY).unwrap();
        let found = find(&words("--background <COLOUR>\n  the scene's own light"), &rules);
        assert_eq!(found.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [1, 2]);
    }

    #[test]
    fn a_glossary_without_its_table_is_a_problem() {
        assert!(rules("# Glossary\n").is_err());
        assert!(rules("<!-- words: begin -->\n<!-- words: end -->\n").is_err());
    }
}
