//! Links between documents lead somewhere.

use crate::problem::Problem;
use crate::sources::Source;

/// What a path leads to.
pub(super) trait Places {
    /// Whether a file or folder is there.
    fn exists(&self, path: &str) -> bool;
    /// The text of a page.
    fn page(&self, path: &str) -> Option<&str>;
}

pub(super) fn check(source: &Source, places: &dyn Places) -> Vec<Problem> {
    if !source.path.ends_with(".md") {
        return Vec::new();
    }
    let folder = source.path.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut problems = Vec::new();
    let mut in_block = false;
    for (i, line) in source.text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            in_block = !in_block;
        } else if !in_block {
            for target in targets(line) {
                if let Some(text) = problem(folder, target, &source.text, places) {
                    problems.push(Problem::error(&source.path, i + 1, text));
                }
            }
        }
    }
    problems
}

/// Pages that code and makefiles name exist: `docs/a/b.md`.
pub(super) fn check_names(source: &Source, places: &dyn Places) -> Vec<Problem> {
    // Tests of these rules name pages that are not there.
    if source.path.ends_with(".md") || source.path.contains("xtask/") {
        return Vec::new();
    }
    let mut problems = Vec::new();
    for (i, line) in source.text.lines().enumerate() {
        for (at, _) in line.match_indices("docs/") {
            let rest = &line[at..];
            let end = rest.find(|c: char| !c.is_alphanumeric() && !"/._-".contains(c));
            let name = &rest[..end.unwrap_or(rest.len())];
            let name = name.find(".md").map_or("", |end| &name[..end + 3]);
            if !name.is_empty() && !places.exists(name) {
                let text = format!("there is no page {name}");
                problems.push(Problem::error(&source.path, i + 1, text));
            }
        }
    }
    problems
}

fn problem(folder: &str, target: &str, own_text: &str, places: &dyn Places) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
    let text = if path.is_empty() {
        Some(own_text)
    } else {
        match resolve(folder, path) {
            Some(resolved) if places.exists(&resolved) => places.page(&resolved),
            _ => return Some(format!("the link leads nowhere: {path}")),
        }
    };
    let known = anchor.is_empty() || text.is_none_or(|text| anchors(text).any(|a| a == anchor));
    (!known).then(|| format!("no heading for the link {target}"))
}

/// Targets of `[text](target)` outside code spans.
pub(super) fn targets(line: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for prose in line.split('`').step_by(2) {
        let mut rest = prose;
        while let Some((_, after)) = rest.split_once("](") {
            let Some((target, tail)) = after.split_once(')') else { break };
            found.push(target.split_whitespace().next().unwrap_or_default());
            rest = tail;
        }
    }
    // A link text in backticks splits the link: `[`a`](b)` starts the next prose with `](`.
    found
}

fn resolve(folder: &str, path: &str) -> Option<String> {
    let mut parts: Vec<&str> = if path.starts_with('/') {
        return None;
    } else {
        folder.split('/').filter(|part| !part.is_empty()).collect()
    };
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// Anchors of the headings of a page.
fn anchors(text: &str) -> impl Iterator<Item = String> + '_ {
    let mut in_block = false;
    text.lines().filter_map(move |line| {
        in_block ^= line.trim_start().starts_with("```");
        if in_block { None } else { slug(line) }
    })
}

/// The anchor of a heading, as forges and mdBook make it.
fn slug(line: &str) -> Option<String> {
    let title = line.strip_prefix('#')?.trim_start_matches('#').trim();
    let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    Some(kept.collect::<String>().to_lowercase().replace(' ', "-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Known;

    impl Places for Known {
        fn exists(&self, path: &str) -> bool {
            ["README.md", "docs/b.md", "docs/formats"].contains(&path)
        }

        fn page(&self, path: &str) -> Option<&str> {
            (path == "docs/b.md").then_some("# X\n```\n# y\n```\n")
        }
    }

    fn lines(text: &str) -> Vec<usize> {
        let source = Source { path: "docs/a.md".into(), text: text.into() };
        check(&source, &Known).into_iter().map(|problem| problem.line).collect()
    }

    #[test]
    fn pages_named_in_code_exist() {
        let text = "//! See `docs/b.md`.\n//! See docs/formats and docs/c.md.\n".into();
        let source = Source { path: "crates/x/src/a.rs".into(), text };
        let found: Vec<usize> = check_names(&source, &Known).iter().map(|p| p.line).collect();
        assert_eq!(found, [2]);
    }

    #[test]
    fn good_links_pass() {
        let text = "# A title, here\n[r](../README.md) ![b](b.md#x) [f](formats/) [`b`](b.md)\n\
                    [w](https://example.org) [h](#a-title-here)\n```\n[x](no.md)\n```\n`[x](no.md)`\n";
        assert!(lines(text).is_empty());
    }

    #[test]
    fn dead_links_fail() {
        let text = "[a](c.md)\n[b](b.md) and [c](../x)\n[d](#nothing)\n[e](../../up)\n[`f`](no.md)\n\
             [g](b.md#y)\n";
        assert_eq!(lines(text), [1, 2, 3, 4, 5, 6]);
    }
}
