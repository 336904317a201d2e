//! Version numbers in pages: `<!-- version: capture -->1.1` is what the code says.
//!
//! Versions of JSON documents come from their schemas, those of PLY files from the comment that
//! the writers put into the header.

use std::collections::BTreeMap;
use std::path::Path;

use motes_formats::schemas::all_schemas;
use serde_json::Value;

use crate::problem::Problem;
use crate::sources::{Source, sources};

const MARK: &str = "<!-- version: ";
const PLY_COMMENT: &str = "motes format motes/";

/// Writes the numbers into all pages.
pub(crate) fn write(root: &Path) -> anyhow::Result<()> {
    let sources = sources(root)?;
    let known = known(&sources);
    let mut count = 0;
    for page in pages(&sources) {
        let text = renewed(&page.text, &known);
        if text != page.text {
            std::fs::write(root.join(&page.path), text)?;
            count += 1;
        }
    }
    crate::say(&format!("versions: {count} pages changed"));
    Ok(())
}

/// Pages whose numbers differ from the code, or that name an unknown document.
pub(crate) fn stale(sources: &[Source]) -> Vec<Problem> {
    let known = known(sources);
    pages(sources).flat_map(|page| problems(page, &known)).collect()
}

fn pages(sources: &[Source]) -> impl Iterator<Item = &Source> {
    sources.iter().filter(|s| s.path.ends_with(".md") && s.text.contains(MARK))
}

fn problems(page: &Source, known: &BTreeMap<String, String>) -> Vec<Problem> {
    let mut found = Vec::new();
    for (i, line) in page.text.lines().enumerate() {
        for (name, number, _) in marks(line) {
            let text = match known.get(name) {
                Some(version) if version == number => continue,
                Some(version) => format!("{name} is {version}: run `cargo xtask schemas`"),
                None => format!("no document is called {name}"),
            };
            found.push(Problem::error(&page.path, i + 1, text));
        }
    }
    found
}

fn renewed(page: &str, known: &BTreeMap<String, String>) -> String {
    let mut text = String::new();
    for line in page.split_inclusive('\n') {
        let mut from = 0;
        for (name, number, at) in marks(line) {
            text.push_str(&line[from..at]);
            text.push_str(known.get(name).map_or(number, |version| version));
            from = at + number.len();
        }
        text.push_str(&line[from..]);
    }
    text
}

/// Name, number and place of the number of every mark in a line.
fn marks(line: &str) -> Vec<(&str, &str, usize)> {
    let mut found = Vec::new();
    let mut from = 0;
    while let Some(start) = line[from..].find(MARK).map(|i| from + i + MARK.len()) {
        let Some((name, rest)) = line[start..].split_once(" -->") else { break };
        let at = line.len() - rest.len();
        let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        // A full stop may end the sentence.
        let number = rest[..end].trim_end_matches('.');
        found.push((name, number, at));
        from = at;
    }
    found
}

/// Name of a document to its version.
fn known(sources: &[Source]) -> BTreeMap<String, String> {
    let mut known = BTreeMap::new();
    let printed = sources.iter().filter(|s| s.path.ends_with(".schema.json"));
    let printed = printed.filter_map(|s| serde_json::from_str::<Value>(&s.text).ok());
    // Those of the stages come from their pages, those that the code here knows from the code.
    for schema in printed.chain(all_schemas().into_iter().map(|(_, schema)| schema)) {
        let format = schema["properties"]["format"]["const"].as_str().unwrap_or_default();
        let version = schema["properties"]["version"]["examples"][0].as_str().unwrap_or_default();
        known.insert(format.trim_start_matches("motes/").to_owned(), version.to_owned());
    }
    let code = |s: &&Source| s.path.ends_with(".rs") && s.path.contains("/src/");
    for source in sources.iter().filter(code) {
        for rest in source.text.split(PLY_COMMENT).skip(1) {
            let mut words = rest.split(|c: char| c != '-' && c != '.' && !c.is_alphanumeric());
            if let (Some(name), Some(version)) = (words.next(), words.next())
                && version.starts_with(|c: char| c.is_ascii_digit())
            {
                known.insert(name.to_owned(), version.to_owned());
            }
        }
    }
    known
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(path: &str, text: &str) -> Source {
        Source { path: path.into(), text: text.into() }
    }

    #[test]
    fn a_stale_number_is_found_and_written() {
        let known =
            known(&[source("crates/x/src/a.rs", "b\"comment motes format motes/mesh 2.5\\n\"")]);
        assert_eq!(known.get("mesh").map(String::as_str), Some("2.5"));
        assert!(known.get("capture").is_some_and(|version| version.contains('.')), "{known:?}");
        let page =
            "a <!-- version: mesh -->1.0. b <!-- version: mesh -->2.5 | <!-- version: none -->1\n";
        let found = problems(&source("docs/a.md", page), &known);
        assert_eq!(found.len(), 2, "{found:?}");
        let expected =
            "a <!-- version: mesh -->2.5. b <!-- version: mesh -->2.5 | <!-- version: none -->1\n";
        assert_eq!(renewed(page, &known), expected);
    }
}
