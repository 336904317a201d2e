//! Modules of a crate that use each other in a circle. Two files that do are one thing in two
//! files; of more than two, none can be read, moved or tested alone.

use std::collections::{BTreeMap, BTreeSet};

use crate::problem::Problem;
use crate::sources::Source;

/// Files of a circle that need no mention.
const MOST: usize = 2;

/// A problem per circle of more than two modules, all crates together.
pub(super) fn check(sources: &[Source]) -> Vec<Problem> {
    let mut crates: BTreeMap<&str, Vec<(&str, &Source)>> = BTreeMap::new();
    for source in sources {
        let Some((package, path)) = source.path.split_once("/src/") else { continue };
        let is_module = path.ends_with(".rs") && !path.starts_with("bin/");
        if is_module && !path.contains("tests") {
            crates.entry(package).or_default().push((path, source));
        }
    }
    crates.iter().flat_map(|(package, files)| circles(package, files)).collect()
}

fn circles(package: &str, files: &[(&str, &Source)]) -> Vec<Problem> {
    let modules: BTreeSet<Vec<&str>> = files.iter().map(|(path, _)| module(path)).collect();
    let uses: BTreeMap<Vec<&str>, BTreeSet<Vec<&str>>> = files
        .iter()
        .map(|(path, source)| {
            let here = module(path);
            let code = code(&source.text);
            let mut used: BTreeSet<_> =
                paths(&code).iter().filter_map(|path| resolve(path, &here, &modules)).collect();
            used.remove(&here);
            (here, used)
        })
        .collect();
    let reach: BTreeMap<_, _> = uses.keys().map(|m| (m.clone(), reachable(m, &uses))).collect();
    let mut told = BTreeSet::new();
    let mut problems = Vec::new();
    for (module, far) in &reach {
        let circle: BTreeSet<_> =
            far.iter().filter(|m| reach.get(*m).is_some_and(|r| r.contains(module))).collect();
        if circle.len() > MOST && !told.contains(module) {
            told.extend(circle.iter().map(|m| (*m).clone()));
            let names: Vec<String> = circle.iter().map(|m| shown(m)).collect();
            let text = format!("{} modules use each other: {}", names.len(), names.join(", "));
            problems.push(Problem::error(format!("{package}/src"), 0, text));
        }
    }
    problems
}

fn shown(module: &[&str]) -> String {
    if module.is_empty() { "lib".into() } else { module.join("::") }
}

/// The path of a file as a module; the root is empty.
fn module(path: &str) -> Vec<&str> {
    let path = path.trim_end_matches(".rs");
    let mut parts: Vec<&str> = path.split('/').collect();
    if matches!(parts.last(), Some(&"mod" | &"lib" | &"main")) {
        parts.pop();
    }
    parts
}

/// The text without comments and without the tests at its end.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join(" ")
}

/// All paths that begin with `crate`, `super` or `self`, those in braces one by one.
fn paths(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for root in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(root) {
            let before = code[..at].chars().next_back();
            if !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
                expand("", &code[at..], &mut found);
            }
        }
    }
    found
}

/// The paths that `text` begins with, behind `prefix`; returns where they end.
fn expand(prefix: &str, text: &str, found: &mut Vec<String>) -> usize {
    let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let end = text.find(|c| !is_path(c)).unwrap_or(text.len());
    let path = format!("{prefix}{}", &text[..end]);
    if !text[end..].starts_with('{') || !path.ends_with("::") {
        found.push(path);
        return end;
    }
    let mut at = end + 1;
    while at < text.len() && !text[at..].starts_with('}') {
        let rest = &text[at..];
        let next = rest.chars().next();
        at += match next {
            Some(c) if is_path(c) => expand(&path, rest, found),
            // The new name behind `as` is a path of its own to this reader, which leads nowhere.
            Some(c) => c.len_utf8(),
            None => break,
        };
    }
    (at + 1).min(text.len())
}

/// The module whose item a path names.
fn resolve<'a>(
    path: &str,
    here: &[&'a str],
    modules: &BTreeSet<Vec<&'a str>>,
) -> Option<Vec<&'a str>> {
    let mut from: Vec<String> = here.iter().map(|part| (*part).to_owned()).collect();
    for part in path.split("::").filter(|part| !part.is_empty()) {
        match part {
            "crate" => from.clear(),
            "self" => {}
            "super" => {
                from.pop();
            }
            name => from.push(name.to_owned()),
        }
    }
    (0..=from.len()).rev().find_map(|n| {
        let wanted = &from[..n];
        modules.iter().find(|m| m.len() == n && m.iter().zip(wanted).all(|(a, b)| a == b)).cloned()
    })
}

/// All modules that one uses, over any number of others.
fn reachable<'a>(
    start: &[&'a str],
    uses: &BTreeMap<Vec<&'a str>, BTreeSet<Vec<&'a str>>>,
) -> BTreeSet<Vec<&'a str>> {
    let mut found = BTreeSet::new();
    let mut open = vec![start.to_vec()];
    while let Some(module) = open.pop() {
        for next in uses.get(&module).into_iter().flatten() {
            if found.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(files: &[(&str, &str)]) -> Vec<String> {
        let source = |(path, text): &(&str, &str)| Source {
            path: format!("crates/x/src/{path}"),
            text: (*text).to_owned(),
        };
        let sources: Vec<Source> = files.iter().map(source).collect();
        check(&sources).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn circles_of_three_files_are_found() {
        let found = problems(&[
            ("a.rs", "use crate::b::{B, Other};\n"),
            ("b/mod.rs", "use super::c::deep::C;\n"),
            ("c.rs", "fn f() { crate::a::g(); }\n"),
            ("d.rs", "use crate::{a::A, b::B};\n"),
        ]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].contains("3 modules use each other: a, b, c"), "{found:?}");
    }

    #[test]
    fn pairs_tests_comments_and_trees_are_not() {
        let pair = [("a.rs", "use crate::b::B;\n"), ("b.rs", "use super::a::A;\n")];
        assert!(problems(&pair).is_empty());
        let tree = [
            ("a.rs", "use crate::{b::{B, c::C}, d};\n"),
            ("b/mod.rs", "use super::d::D; // crate::a::A\n"),
            ("b/c.rs", "use crate::d::D;\n#[cfg(test)]\nmod tests { use crate::a::A; }\n"),
            ("d.rs", "use glam::Vec3;\n"),
        ];
        assert!(problems(&tree).is_empty(), "{:?}", problems(&tree));
    }
}
