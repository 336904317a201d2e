//! The pages of `docs/` and their table of contents: each page is in it once, methods stay short,
//! and no page leads out of the site.

use super::prose::{prose, words};
use crate::problem::Problem;
use crate::sources::Source;

const SUMMARY: &str = "docs/SUMMARY.md";
/// A method is read in one sitting.
const METHOD_WORDS: usize = 2500;

pub(super) fn check(sources: &[Source]) -> Vec<Problem> {
    let Some(summary) = sources.iter().find(|s| s.path == SUMMARY) else {
        return vec![Problem::error(SUMMARY, 0, "is missing")];
    };
    let listed: Vec<(usize, String)> = summary
        .text
        .lines()
        .enumerate()
        .flat_map(|(i, line)| super::links::targets(line).into_iter().map(move |t| (i + 1, t)))
        .map(|(line, target)| (line, format!("docs/{target}")))
        .collect();
    let mut problems = Vec::new();
    for (i, (line, page)) in listed.iter().enumerate() {
        if listed.iter().take(i).any(|(_, other)| other == page) {
            problems.push(Problem::error(SUMMARY, *line, format!("lists {page} twice")));
        }
    }
    let is_page =
        |s: &&Source| s.path.starts_with("docs/") && s.path.ends_with(".md") && s.path != SUMMARY;
    for page in sources.iter().filter(is_page) {
        if !listed.iter().any(|(_, path)| *path == page.path) {
            problems.push(Problem::error(&page.path, 0, format!("is not in {SUMMARY}")));
        }
        problems.extend(leaves_the_site(page));
        problems.extend(too_long(page));
    }
    problems
}

fn leaves_the_site(page: &Source) -> Vec<Problem> {
    let depth = page.path.matches('/').count() - 1;
    let lines = page.text.lines().enumerate();
    lines
        .filter(|(_, line)| {
            super::links::targets(line).iter().any(|t| t.matches("../").count() > depth)
        })
        .map(|(i, _)| {
            let text = "the link leaves docs/, and the site with it: name the path instead";
            Problem::error(&page.path, i + 1, text)
        })
        .collect()
}

fn too_long(page: &Source) -> Option<Problem> {
    let count = words(&prose(&page.text)).iter().filter(|w| !w.text.is_empty()).count();
    let is_long = page.path.starts_with("docs/methods/") && count > METHOD_WORDS;
    let text = format!("{count} words, more than {METHOD_WORDS}");
    is_long.then(|| Problem::error(&page.path, 0, text))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(pages: &[(&str, &str)]) -> Vec<String> {
        let source = |(path, text): &(&str, &str)| Source {
            path: (*path).to_owned(),
            text: (*text).to_owned(),
        };
        let sources: Vec<Source> = pages.iter().map(source).collect();
        check(&sources).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn pages_are_listed_once_and_stay_inside() {
        let summary = "[A](a.md)\n- [B](b/c.md)\n- [again](a.md)\n";
        let found = problems(&[
            (SUMMARY, summary),
            ("docs/a.md", "[up](../README.md)\n"),
            ("docs/b/c.md", "[a](../a.md)\n"),
            ("docs/d.md", ""),
        ]);
        assert_eq!(found.len(), 3, "{found:?}");
        for (text, part) in found.iter().zip(["twice", "docs/a.md:1: the link leaves", "docs/d.md"])
        {
            assert!(text.contains(part), "{text}");
        }
        assert!(problems(&[("docs/a.md", "")])[0].contains("is missing"));
    }

    #[test]
    fn methods_are_short() {
        let long = "word ".repeat(METHOD_WORDS + 1);
        let summary = "[A](methods/a.md) [B](b.md)";
        let found =
            problems(&[(SUMMARY, summary), ("docs/methods/a.md", &long), ("docs/b.md", &long)]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].contains("2501 words"), "{found:?}");
    }
}
