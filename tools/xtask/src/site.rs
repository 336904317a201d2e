//! Links of the rendered site: every `href` and `src` inside `target/site` leads to a file, and
//! every anchor to an element.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};

const FOLDER: &str = "target/site";
/// mdBook's own pages: the whole book on one page repeats anchors, the other is for servers.
const GENERATED: [&str; 3] = ["print.html", "404.html", "toc.html"];

pub(crate) fn run(root: &Path) -> anyhow::Result<()> {
    let folder = root.join(FOLDER);
    let pages = pages(&folder)?;
    ensure!(!pages.is_empty(), "no pages in {FOLDER}: run `make docs`");
    let ids: BTreeMap<&Path, BTreeSet<&str>> =
        pages.iter().map(|(path, html)| (path.as_path(), values(html, "id").collect())).collect();
    let mut dead = Vec::new();
    for (path, html) in &pages {
        for target in values(html, "href").chain(values(html, "src")) {
            if let Some(problem) = problem(path, target, &ids) {
                let shown = path.strip_prefix(&folder).unwrap_or(path).display();
                dead.push(format!("{shown}: {problem}"));
            }
        }
    }
    for line in &dead {
        crate::say(line);
    }
    if !dead.is_empty() {
        bail!("{} dead links", dead.len());
    }
    crate::say(&format!("site: {} pages in {FOLDER}, all links lead somewhere", pages.len()));
    Ok(())
}

fn pages(folder: &Path) -> anyhow::Result<BTreeMap<PathBuf, String>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with(".html") && !GENERATED.contains(&name.as_str()) {
                let html = std::fs::read_to_string(&path)?;
                found.insert(path, html);
            }
        }
    }
    Ok(found)
}

fn problem(page: &Path, target: &str, ids: &BTreeMap<&Path, BTreeSet<&str>>) -> Option<String> {
    if target.contains(':') || target.starts_with("//") {
        return None;
    }
    let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
    let path = path.split('?').next().unwrap_or_default();
    let file = if path.is_empty() { page.to_owned() } else { joined(page, path) };
    if !file.exists() {
        return Some(format!("leads nowhere: {target}"));
    }
    let known = ids.get(file.as_path()).is_none_or(|ids| anchor.is_empty() || ids.contains(anchor));
    (!known).then(|| format!("no such place: {target}"))
}

/// A relative path from a page, without `.` and `..`.
fn joined(page: &Path, target: &str) -> PathBuf {
    let mut path = page.parent().unwrap_or(Path::new("")).to_owned();
    for part in target.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                path.pop();
            }
            part => path.push(part),
        }
    }
    path
}

/// Values of an attribute in double quotes.
fn values<'a>(html: &'a str, attribute: &'a str) -> impl Iterator<Item = &'a str> {
    html.split('<').skip(1).filter_map(move |tag| {
        let tag = tag.split_once('>').map_or(tag, |(tag, _)| tag);
        let (before, after) = tag.split_once(&format!("{attribute}=\""))?;
        let value = after.split_once('"')?.0;
        before.ends_with(char::is_whitespace).then_some(value)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dead_links_and_anchors_of_a_site_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join(FOLDER);
        std::fs::create_dir_all(folder.join("b")).unwrap();
        std::fs::write(folder.join("b/c.html"), "<h1 id=\"x\">X</h1><a href=\"../a.html\">a</a>")
            .unwrap();
        let good = "<a href=\"b/c.html#x\">c</a><a href=\"https://example.org\">w</a>";
        std::fs::write(folder.join("a.html"), good).unwrap();
        run(dir.path()).unwrap();
        std::fs::write(folder.join("a.html"), "<a href=\"b/c.html#y\"><img src=\"d.png\">")
            .unwrap();
        let error = run(dir.path()).unwrap_err().to_string();
        assert_eq!(error, "2 dead links");
    }

    #[test]
    fn a_site_that_was_not_rendered_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        assert!(run(dir.path()).is_err());
    }
}
