//! Rules that no compiler checks. One file per rule; each takes text and returns problems, so
//! that its tests can show it failing.

mod circles;
mod contents;
mod functions;
mod layers;
mod length;
mod links;
mod machine_paths;
mod measurements;
mod mirrors;
mod modules;
mod paths;
mod placeholders;
mod programs;
pub(crate) mod prose;
mod shell;
mod stage_words;
mod tables;
pub(crate) mod vocabulary;

use std::path::Path;

use anyhow::bail;

use crate::problem::Problem;
use crate::sources::{Source, sources};
use crate::{generate, metadata, recipes, schemas, versions};

pub(crate) fn run(root: &Path) -> anyhow::Result<()> {
    let sources = sources(root)?;
    let stages = generate::stage_names(root);
    let mut problems = schemas::stale(root);
    let architecture = sources.iter().find(|s| s.path == "docs/ARCHITECTURE.md");
    match architecture {
        Some(table) => {
            problems.extend(layers::check(&table.text, &metadata::read(root, false)?));
        }
        None => problems.push(Problem::error("docs/ARCHITECTURE.md", 0, "is missing")),
    }
    problems.extend(versions::stale(&sources));
    problems.extend(recipes::stale(root));
    problems.extend(contents::check(&sources));
    problems.extend(circles::check(&sources));
    problems.extend(mirrors::check(&sources));
    problems.extend(programs::check(&sources));
    let glossary = sources.iter().find(|s| s.path == vocabulary::FILE);
    let words = vocabulary::rules(glossary.map_or("", |s| &s.text)).unwrap_or_else(|problem| {
        problems.push(problem);
        Vec::new()
    });
    let places = Repository { root, sources: &sources };
    for source in &sources {
        problems.extend(vocabulary::check(source, &words));
        problems.extend(measurements::check(source));
        problems.extend(tables::check(source));
        problems.extend(length::check(source));
        problems.extend(functions::check(source));
        problems.extend(modules::check(source, &stages));
        problems.extend(placeholders::check(source));
        problems.extend(machine_paths::check(source));
        problems.extend(stage_words::check(source, &stages));
        problems.extend(links::check(source, &places));
        problems.extend(links::check_names(source, &places));
        problems.extend(paths::check(source, &places));
    }
    for stage in &stages {
        let named = |s: &&Source| s.path == "README.md" && s.text.contains(&format!("`{stage}`"));
        if !sources.iter().any(|s| named(&s)) {
            problems.push(Problem::error(
                "README.md",
                0,
                format!("does not name the stage {stage}"),
            ));
        }
    }
    for problem in &problems {
        crate::say(&problem.to_string());
    }
    let failed = problems.iter().filter(|p| p.fails).count();
    if failed > 0 {
        bail!("{failed} problems");
    }
    crate::say(&format!("tidy: {}", length::summary(&sources)));
    Ok(())
}

/// Where links lead.
struct Repository<'a> {
    root: &'a Path,
    sources: &'a [Source],
}

impl links::Places for Repository<'_> {
    fn exists(&self, path: &str) -> bool {
        self.root.join(path).exists()
    }

    fn page(&self, path: &str) -> Option<&str> {
        let page = self.sources.iter().find(|s| s.path == path && path.ends_with(".md"));
        page.map(|s| s.text.as_str())
    }
}
