//! The stages that exist, in the order of the pipeline.

use crate::find::{Finder, is_program};

/// Headings of `motes help`, in pipeline order.
pub(crate) const GROUPS: &[&str] =
    &["Input", "Model", "Appearance", "Edit", "Output", "Measure", "Other"];

/// Name and group of every stage of the suite. One that is not installed is not listed.
const KNOWN: &[(&str, &str)] = &[
    ("import-colmap", "Input"),
    ("train-splat", "Model"),
    ("decompose", "Appearance"),
    ("relight", "Appearance"),
    ("estimate-environment", "Appearance"),
    ("segment-select", "Edit"),
    ("edit", "Edit"),
    ("instruct", "Edit"),
    ("view", "Edit"),
    ("export", "Output"),
    ("render", "Output"),
    ("evaluate", "Measure"),
    ("report", "Measure"),
    ("info", "Measure"),
    ("provider", "Measure"),
];

/// Short and earlier names: the program that is meant, and its first argument.
const OTHER_NAMES: &[(&str, &str, &str)] = &[
    ("lab-report", "report", "lab"),
    ("relight-report", "report", "relight"),
    ("table", "report", "table"),
];

/// The stage and the first argument that a short or earlier name stands for.
pub(crate) fn renamed(typed: &str) -> Option<(&'static str, &'static str)> {
    OTHER_NAMES.iter().find(|(old, ..)| *old == typed).map(|&(_, stage, subject)| (stage, subject))
}

/// Whether a stage is one of the suite.
pub(crate) fn is_known(name: &str) -> bool {
    KNOWN.iter().any(|(known, _)| *known == name)
}

/// A stage that can run.
#[derive(Debug)]
pub(crate) struct Stage {
    pub(crate) name: String,
    pub(crate) group: &'static str,
}

/// Known stages that are installed, then those of third parties (`motes-NAME` on `PATH`), sorted.
pub(crate) fn available(finder: &Finder) -> Vec<Stage> {
    let mut stages: Vec<Stage> = KNOWN
        .iter()
        .filter(|(name, _)| finder.find(name).is_some())
        .map(|&(name, group)| Stage { name: name.to_owned(), group })
        .collect();
    let mut others: Vec<String> = finder
        .path
        .iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flatten()
        .filter_map(|entry| {
            let entry = entry.ok()?;
            let name = entry.file_name().into_string().ok()?;
            let name = name.strip_suffix(std::env::consts::EXE_SUFFIX)?.strip_prefix("motes-")?;
            is_program(&entry.path()).then(|| name.to_owned())
        })
        .filter(|name| !is_known(name))
        .filter(|name| finder.find(name).is_some())
        .collect();
    others.sort();
    others.dedup();
    stages.extend(others.into_iter().map(|name| Stage { name, group: "Other" }));
    stages
}

/// The stage that was probably meant: the typed word is a part of it, or at most a third of the
/// letters differ.
pub(crate) fn nearest<'a>(typed: &str, stages: &'a [Stage]) -> Option<&'a str> {
    let names = || stages.iter().map(|stage| stage.name.as_str());
    let part = names().find(|name| typed.len() >= 3 && name.contains(typed));
    part.or_else(|| {
        let (distance, name) = names().map(|name| (edit_distance(typed, name), name)).min()?;
        (distance * 3 <= name.len()).then_some(name)
    })
}

/// Levenshtein distance, one row at a time.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances() {
        for (a, b, d) in [("", "abc", 3), ("kitten", "sitting", 3), ("render", "render", 0)] {
            assert_eq!(edit_distance(a, b), d);
            assert_eq!(edit_distance(b, a), d);
        }
    }

    #[test]
    fn the_nearest_name_is_near() {
        let stages: Vec<Stage> = ["train-splat", "render", "evaluate"]
            .map(|name| Stage { name: name.into(), group: "Other" })
            .into();
        assert_eq!(nearest("trainsplat", &stages), Some("train-splat"));
        assert_eq!(nearest("train", &stages), Some("train-splat"));
        assert_eq!(nearest("rendr", &stages), Some("render"));
        assert_eq!(nearest("frobnicate", &stages), None);
    }
}
