//! Dependencies point one way: the table in `docs/ARCHITECTURE.md` is the law.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::metadata::{list, text};
use crate::problem::Problem;

const FILE: &str = "docs/ARCHITECTURE.md";
/// Usable by tests of every crate.
const TEST_ONLY: &str = "testkit";
/// Its tests are those of the whole suite.
const SUITE: &str = "motes";

/// What a row allows.
struct Row {
    workspace: Vec<String>,
    /// No crate from outside either.
    std_only: bool,
}

pub(super) fn check(architecture: &str, metadata: &Value) -> Vec<Problem> {
    let table = parse(architecture);
    let packages = list(metadata, "packages");
    let folder_of = |package: &Value| folder(text(package, "name").unwrap_or_default());
    let ours: Vec<String> = packages.iter().map(folder_of).collect();
    let mut problems = Vec::new();
    for package in packages {
        let name = folder_of(package);
        let Some(row) = table.get(&name) else {
            problems.push(Problem::error(FILE, 0, format!("has no row for the crate {name}")));
            continue;
        };
        for dependency in list(package, "dependencies") {
            let target = folder(text(dependency, "name").unwrap_or_default());
            let for_tests = text(dependency, "kind") == Some("dev");
            let allowed = if ours.contains(&target) {
                row.workspace.contains(&target)
                    || (for_tests && (target == TEST_ONLY || name == SUITE))
            } else {
                for_tests || !row.std_only
            };
            if !allowed {
                let kind = if for_tests { "dev-depend" } else { "depend" };
                let manifest = text(package, "manifest_path").unwrap_or_default();
                let manifest = manifest.rsplit("/crates/").next().unwrap_or(manifest);
                let rule = format!("{name} may not {kind} on {target} (see {FILE})");
                problems.push(Problem::error(manifest, 0, rule));
            }
        }
    }
    for name in table.keys().filter(|name| !ours.contains(name)) {
        problems.push(Problem::error(
            FILE,
            0,
            format!("has a row for {name}, which is not a crate"),
        ));
    }
    problems
}

/// Packages carry a prefix that their folders do not.
fn folder(package: &str) -> String {
    package.strip_prefix("motes-").unwrap_or(package).to_owned()
}

/// Rows of the first table whose second column is headed `may depend on`: names in backticks.
fn parse(architecture: &str) -> BTreeMap<String, Row> {
    let cells = |line: &str| -> Vec<String> {
        line.trim().trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()
    };
    architecture
        .lines()
        .skip_while(|line| cells(line).get(1).is_none_or(|cell| cell != "may depend on"))
        .skip(2)
        .take_while(|line| line.trim_start().starts_with('|'))
        .filter_map(|line| {
            let cells = cells(line);
            let name = quoted(cells.first()?).into_iter().next()?;
            let rule = cells.get(1)?;
            let row = Row { workspace: quoted(rule), std_only: rule.contains("std only") };
            Some((name, row))
        })
        .collect()
}

fn quoted(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const TABLE: &str = "\
text | with | bars
| crate | may depend on | never |
|---|---|---|
| `math` | nothing of ours | files |
| `scene` | `math` | files |
| `testkit` | `scene` | - |
| `motes` | nothing (std only) | - |

| other | table |
";

    fn check_with(package: &str, dependency: &str, kind: Value) -> Vec<Problem> {
        let mut packages: Vec<Value> = ["motes-math", "motes-scene", "motes-testkit", "motes"]
            .iter()
            .map(|name| json!({ "name": name, "dependencies": [], "manifest_path": "x" }))
            .collect();
        let target = packages.iter_mut().find(|p| p["name"] == package).unwrap();
        target["dependencies"] = json!([{ "name": dependency, "kind": kind }]);
        check(TABLE, &json!({ "packages": packages }))
    }

    #[test]
    fn edges_of_the_table_pass() {
        assert_eq!(check_with("motes-scene", "motes-math", Value::Null), []);
        assert_eq!(check_with("motes-scene", "glam", Value::Null), []);
        assert_eq!(check_with("motes-math", "motes-testkit", json!("dev")), []);
        assert_eq!(check_with("motes", "tempfile", json!("dev")), []);
    }

    #[test]
    fn other_edges_fail() {
        for (package, dependency, kind) in [
            ("motes-math", "motes-scene", Value::Null),
            ("motes-math", "motes-scene", json!("dev")),
            ("motes-math", "motes-scene", json!("build")),
            ("motes-scene", "motes-testkit", Value::Null),
            ("motes", "libc", Value::Null),
        ] {
            let problems = check_with(package, dependency, kind.clone());
            assert_eq!(problems.len(), 1, "{package} -> {dependency} ({kind})");
        }
    }

    #[test]
    fn table_and_workspace_name_the_same_crates() {
        let package = |name: &str| json!({ "name": name, "dependencies": [] });
        let all = ["motes-math", "motes-scene", "motes-testkit", "motes", "motes-new"];
        let problems = check(TABLE, &json!({ "packages": all.map(package) }));
        assert!(problems[0].text.contains("no row for the crate new"), "{problems:?}");
        let problems = check(TABLE, &json!({ "packages": [package("motes")] }));
        assert_eq!(problems.len(), 3, "{problems:?}");
    }
}
