//! The recipes of `docs/extending.md`, tried: each patch of `docs/extending/` is applied to a checkout of HEAD, and the commands
//! that it names are run there.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, bail, ensure};

use crate::problem::Problem;

const FOLDER: &str = "docs/extending";
/// Starts the lines of a patch that say how to check it.
const CHECK: &str = "Check: ";
/// What a recipe may touch beside tests and pages.
const MOST_FILES: usize = 3;

/// The patches, in the order of their names.
fn patches(root: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut patches: Vec<_> = std::fs::read_dir(root.join(FOLDER))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|suffix| suffix == "patch"))
        .collect();
    patches.sort();
    Ok(patches)
}

/// Patches that no longer apply to the working tree.
pub(crate) fn stale(root: &Path) -> Vec<Problem> {
    let check = |patch: PathBuf| {
        let done =
            Command::new("git").args(["apply", "--check"]).arg(&patch).current_dir(root).output();
        let name = format!("{FOLDER}/{}", patch.file_name().unwrap_or_default().to_string_lossy());
        let said = match done {
            Ok(done) if done.status.success() => return None,
            Ok(done) => String::from_utf8_lossy(&done.stderr).trim().replace('\n', "; "),
            Err(error) => error.to_string(),
        };
        Some(Problem::error(name, 0, format!("does not apply: {said}")))
    };
    patches(root).unwrap_or_default().into_iter().filter_map(check).collect()
}

pub(crate) fn run(root: &Path) -> anyhow::Result<()> {
    let patches = patches(root)?;
    ensure!(!patches.is_empty(), "there are no patches in {FOLDER}");
    let checkout = root.join("target/recipes/checkout");
    remove(root, &checkout)?;
    git(root, &["worktree", "add", "--quiet", "--detach", &checkout.to_string_lossy(), "HEAD"])?;
    let tried = patches.iter().try_for_each(|patch| {
        let name = patch.file_name().unwrap_or_default().to_string_lossy().into_owned();
        crate::say(&format!("recipes: {name}"));
        let done = try_recipe(root, &checkout, patch).with_context(|| name);
        git(&checkout, &["checkout", "--quiet", "."])?;
        git(&checkout, &["clean", "--quiet", "--force", "-d"])?;
        done
    });
    remove(root, &checkout)?;
    tried?;
    crate::say(&format!("recipes: {} work", patches.len()));
    Ok(())
}

/// Applies a patch and runs its checks.
fn try_recipe(root: &Path, checkout: &Path, patch: &Path) -> anyhow::Result<()> {
    let text = std::fs::read_to_string(patch)?;
    let code = sources(&text);
    ensure!(code.len() <= MOST_FILES, "touches {} files: {}", code.len(), code.join(", "));
    let checks: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix(CHECK)).collect();
    ensure!(!checks.is_empty(), "no line says \"{CHECK}cargo ...\"");
    git(checkout, &["apply", &patch.to_string_lossy()])?;
    for check in checks {
        let mut words = check.split_whitespace();
        ensure!(words.next() == Some("cargo"), "a check starts with cargo: {check}");
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let ended = Command::new(cargo)
            .args(words)
            .current_dir(checkout)
            .env("CARGO_TARGET_DIR", root.join("target/recipes/build"))
            .status()?;
        ensure!(ended.success(), "failed: {check}");
    }
    Ok(())
}

/// Files of a patch that are neither tests nor pages.
fn sources(patch: &str) -> Vec<&str> {
    let files = patch.lines().filter_map(|line| line.strip_prefix("+++ b/"));
    files.filter(|file| !file.starts_with("docs/") && !file.contains("/tests/")).collect()
}

fn remove(root: &Path, checkout: &Path) -> anyhow::Result<()> {
    if checkout.exists() {
        git(root, &["worktree", "remove", "--force", &checkout.to_string_lossy()])?;
    }
    Ok(())
}

fn git(folder: &Path, arguments: &[&str]) -> anyhow::Result<()> {
    let ended = Command::new("git").args(arguments).current_dir(folder).status()?;
    if !ended.success() {
        bail!("git {} failed", arguments.join(" "));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_recipe_says_how_to_check_it_and_touches_few_files() {
        let mut count = 0;
        for path in patches(&crate::root()).unwrap() {
            let text = std::fs::read_to_string(&path).unwrap();
            let code = sources(&text);
            assert!((1..=MOST_FILES).contains(&code.len()), "{}: {code:?}", path.display());
            assert!(text.lines().any(|line| line.starts_with(CHECK)), "{}", path.display());
            count += 1;
        }
        assert!(count >= 4, "{count} recipes");
    }
}
