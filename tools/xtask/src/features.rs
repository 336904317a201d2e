//! Whether every selection of packages compiles the shared dependencies with the same features.
//!
//! Cargo unifies features over what a command selects, so `cargo test -p edit` may want `libc` otherwise than
//! `cargo test --workspace` does, and then compiles most of the house a second time. `tools/features` declares what differs.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, bail};

use crate::metadata::{self, list, text};

/// The crate that declares them, and the one above it, which is small: neither has to agree.
const DECLARING: [&str; 2] = ["motes-features", "motes-math"];
/// Built and tested by a target of its own, with dependencies that nothing else has.
pub(crate) const APART: &str = "provider-diffusion";

pub(crate) fn run(root: &Path) -> anyhow::Result<()> {
    let workspace = dependencies(root, &["--workspace", "--exclude", APART])?;
    let metadata = metadata::read(root, false)?;
    let mut differing: BTreeSet<String> = BTreeSet::new();
    let mut count = 0;
    for package in list(&metadata, "packages") {
        let name = text(package, "name").unwrap_or("?");
        if DECLARING.contains(&name) || name == APART {
            continue;
        }
        for edges in ["normal,build", "normal,build,dev"] {
            let alone = dependencies(root, &["--package", name, "--edges", edges])?;
            for dependency in alone.difference(&workspace) {
                differing.insert(format!("{dependency}: asked for by {name} alone ({edges})"));
            }
        }
        count += 1;
    }
    if differing.is_empty() {
        crate::say(&format!("features: {count} packages compile what the workspace compiles"));
        return Ok(());
    }
    differing.iter().for_each(|line| crate::say(line));
    bail!(
        "{} dependencies would be compiled twice: declare features in tools/features",
        differing.len()
    )
}

/// Name, version and features of the dependencies of a selection that come from elsewhere.
fn dependencies(root: &Path, selection: &[&str]) -> anyhow::Result<BTreeSet<String>> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let done = Command::new(cargo)
        .args(["tree", "--locked", "--prefix", "none", "--format", "{p} [{f}]"])
        .args(selection)
        .current_dir(root)
        .output()
        .context("cannot start cargo tree")?;
    if !done.status.success() {
        bail!(
            "cargo tree {}: {}",
            selection.join(" "),
            String::from_utf8_lossy(&done.stderr).trim()
        );
    }
    Ok(foreign(&String::from_utf8_lossy(&done.stdout)))
}

/// The lines of packages that do not lie in this repository, which cargo prints with their path.
fn foreign(tree: &str) -> BTreeSet<String> {
    let lines = tree.lines().map(|line| line.trim_end_matches(" (*)"));
    lines.filter(|line| line.contains('[') && !line.contains('/')).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dependencies_with_other_features_differ_and_our_own_packages_do_not_count() {
        let workspace = foreign("libc v0.2.1 [default,std]\nedit v0.1.0 (/src/crates/edit) []\n");
        let same = foreign("libc v0.2.1 [default,std] (*)\nxtask v0.1.0 (/src/tools/xtask) [a]\n");
        let other = foreign("libc v0.2.1 [std]\n");
        assert_eq!(same.difference(&workspace).count(), 0);
        assert_eq!(other.difference(&workspace).collect::<Vec<_>>(), ["libc v0.2.1 [std]"]);
    }
}
