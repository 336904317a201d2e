//! JSON Schemas in `docs/formats/schema/`, generated from the types of `motes-formats` and printed by the stages that have a
//! document of their own.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context as _, ensure};
use motes_formats::documents;
use motes_formats::schemas::all_schemas;

use crate::problem::Problem;

const FOLDER: &str = "docs/formats/schema";
/// Schemas that a stage prints, and the stage. Its own tests compare them: `tidy` builds no stage.
const PRINTED: [(&str, &str); 1] = [("edit-plan-v1.schema.json", "edit")];

pub(crate) fn write(root: &Path) -> anyhow::Result<()> {
    let folder = root.join(FOLDER);
    std::fs::create_dir_all(&folder)?;
    let mut schemas = generated();
    for (name, stage) in PRINTED {
        schemas.insert(name.into(), printed(root, stage)?);
    }
    for name in on_disk(&folder) {
        if !schemas.contains_key(&name) {
            std::fs::remove_file(folder.join(name))?;
        }
    }
    for (name, text) in &schemas {
        std::fs::write(folder.join(name), text).with_context(|| name.clone())?;
    }
    crate::say(&format!("schemas: {} in {FOLDER}/", schemas.len()));
    Ok(())
}

/// Schemas that the code no longer agrees with.
pub(crate) fn stale(root: &Path) -> Vec<Problem> {
    differences(&generated(), &root.join(FOLDER))
}

/// File name to text.
fn generated() -> BTreeMap<String, String> {
    let schemas = all_schemas().into_iter();
    schemas
        .map(|(name, schema)| (format!("{name}.schema.json"), documents::to_pretty_json(&schema)))
        .collect()
}

/// What `STAGE --print-schema` says.
fn printed(root: &Path, stage: &str) -> anyhow::Result<String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["run", "--quiet", "--release", "--package", stage, "--", "--print-schema"])
        .current_dir(root)
        .stderr(Stdio::inherit())
        .output()?;
    ensure!(output.status.success(), "{stage} --print-schema failed");
    Ok(String::from_utf8(output.stdout)?)
}

fn differences(schemas: &BTreeMap<String, String>, folder: &Path) -> Vec<Problem> {
    let remedy = "run `cargo xtask schemas`";
    let mut problems = Vec::new();
    for (name, text) in schemas {
        let file = format!("{FOLDER}/{name}");
        match std::fs::read_to_string(folder.join(name)) {
            Ok(found) if found == *text => {}
            Ok(_) => problems.push(Problem::error(file, 0, format!("is stale: {remedy}"))),
            Err(_) => problems.push(Problem::error(file, 0, format!("is missing: {remedy}"))),
        }
    }
    let known = |name: &String| {
        schemas.contains_key(name) || PRINTED.iter().any(|(printed, _)| printed == name)
    };
    for name in on_disk(folder).into_iter().filter(|name| !known(name)) {
        let file = format!("{FOLDER}/{name}");
        problems.push(Problem::error(file, 0, format!("belongs to no document: {remedy}")));
    }
    problems
}

fn on_disk(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    names.filter(|name| name.ends_with(".schema.json")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stale_missing_or_orphaned_schema_is_found() {
        let dir = tempfile::tempdir().unwrap();
        let schemas: BTreeMap<_, _> =
            ["a", "b", "c"].map(|n| (format!("{n}.schema.json"), format!("{{{n}}}"))).into();
        std::fs::write(dir.path().join("a.schema.json"), "{a}").unwrap();
        std::fs::write(dir.path().join("b.schema.json"), "{old}").unwrap();
        std::fs::write(dir.path().join("d.schema.json"), "{d}").unwrap();
        let found: Vec<String> =
            differences(&schemas, dir.path()).iter().map(|p| p.to_string()).collect();
        assert_eq!(found.len(), 3, "{found:?}");
        for (text, word) in found.iter().zip([
            "b.schema.json: is stale",
            "c.schema.json: is missing",
            "d.schema.json: belongs",
        ]) {
            assert!(text.contains(word), "{text}");
        }
    }

    #[test]
    fn the_documents_have_schemas() {
        let schemas = generated();
        assert!(schemas.keys().any(|name| name.starts_with("capture-v")), "{:?}", schemas.keys());
        for (name, text) in &schemas {
            serde_json::from_str::<serde_json::Value>(text)
                .unwrap_or_else(|e| panic!("{name}: {e}"));
        }
    }
}
