//! Licenses and sources of all dependencies against `deny.toml`.
//!
//! The same file and the same meaning as cargo-deny's `licenses` and `sources` checks, so that
//! either can be run; this one needs no installation.

use std::path::Path;

use anyhow::{Context as _, bail};
use serde_json::Value;
use spdx::{Expression, Licensee, ParseMode};

use crate::metadata::{self, list, text};

/// The part of `deny.toml` that is checked here.
#[derive(Debug, serde::Deserialize)]
struct Deny {
    licenses: Licenses,
    sources: Sources,
}

#[derive(Debug, serde::Deserialize)]
struct Licenses {
    allow: Vec<String>,
    #[serde(default)]
    exceptions: Vec<Exception>,
}

/// A license that one package alone may have.
#[derive(Debug, serde::Deserialize)]
struct Exception {
    #[serde(alias = "name")]
    #[serde(rename = "crate")]
    package: String,
    allow: Vec<String>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
struct Sources {
    allow_registry: Vec<String>,
}

pub(crate) fn run(root: &Path) -> anyhow::Result<()> {
    let deny = read_deny(&root.join("deny.toml"))?;
    let metadata = metadata::read(root, true)?;
    let problems = check(&deny, &metadata)?;
    for problem in &problems {
        crate::say(problem);
    }
    let count = list(&metadata, "packages").len();
    if !problems.is_empty() {
        bail!("{} of {count} packages break deny.toml", problems.len());
    }
    crate::say(&format!("licenses: {count} packages agree with deny.toml"));
    Ok(())
}

fn read_deny(path: &Path) -> anyhow::Result<Deny> {
    let text = std::fs::read_to_string(path).context("cannot read deny.toml")?;
    toml::from_str(&text).context("deny.toml")
}

fn check(deny: &Deny, metadata: &Value) -> anyhow::Result<Vec<String>> {
    let allow = licensees(&deny.licenses.allow)?;
    let mut problems = Vec::new();
    for package in list(metadata, "packages") {
        let name = text(package, "name").unwrap_or("?");
        let version = text(package, "version").unwrap_or("?");
        let mut allowed = allow.clone();
        for exception in deny.licenses.exceptions.iter().filter(|e| e.package == name) {
            allowed.extend(licensees(&exception.allow)?);
        }
        if let Some(problem) = license_problem(text(package, "license"), &allowed) {
            problems.push(format!("{name} {version}: {problem}"));
        }
        // Our own packages have no source.
        if let Some(source) = text(package, "source")
            && !deny.sources.allow_registry.iter().any(|r| source == format!("registry+{r}"))
        {
            problems.push(format!("{name} {version}: comes from {source}"));
        }
    }
    Ok(problems)
}

fn licensees(names: &[String]) -> anyhow::Result<Vec<Licensee>> {
    names
        .iter()
        .map(|name| Licensee::parse(name).with_context(|| format!("deny.toml: license {name:?}")))
        .collect()
}

fn license_problem(license: Option<&str>, allowed: &[Licensee]) -> Option<String> {
    let Some(license) = license else { return Some("has no SPDX license".into()) };
    // Old manifests write `MIT/Apache-2.0`.
    let mode = ParseMode { allow_slash_as_or_operator: true, ..ParseMode::STRICT };
    match Expression::parse_mode(license, mode) {
        Err(error) => {
            Some(format!("license is not an SPDX expression ({}): {license}", error.reason))
        }
        Ok(expression) => {
            let met = expression.evaluate(|need| allowed.iter().any(|have| have.satisfies(need)));
            (!met).then(|| format!("license is not allowed: {license}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn deny() -> Deny {
        toml::from_str(
            r#"[licenses]
               allow = ["MIT", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "Zlib"]
               exceptions = [{ crate = "special", allow = ["OpenSSL"] }]
               [sources]
               allow-registry = ["https://index"]"#,
        )
        .unwrap()
    }

    fn problems(name: &str, license: Value, source: Value) -> Vec<String> {
        let package =
            json!({ "name": name, "version": "1.0.0", "license": license, "source": source });
        check(&deny(), &json!({ "packages": [package] })).unwrap()
    }

    #[test]
    fn expressions_are_understood() {
        for (license, ok) in [
            ("MIT", true),
            ("MIT/Apache-2.0", true),
            ("GPL-3.0-only OR MIT", true),
            ("GPL-3.0-only AND MIT", false),
            ("(MIT OR AGPL-3.0-only) AND Zlib", true),
            ("Apache-2.0 WITH LLVM-exception OR GPL-2.0-only", true),
            ("AGPL-3.0-or-later", false),
            ("Beer", false),
        ] {
            assert_eq!(problems("x", json!(license), Value::Null).is_empty(), ok, "{license}");
        }
        assert_eq!(problems("x", Value::Null, Value::Null), ["x 1.0.0: has no SPDX license"]);
    }

    #[test]
    fn exceptions_are_for_one_package() {
        assert!(problems("special", json!("OpenSSL"), Value::Null).is_empty());
        assert!(!problems("other", json!("OpenSSL"), Value::Null).is_empty());
    }

    #[test]
    fn sources_are_checked() {
        assert!(problems("x", json!("MIT"), json!("registry+https://index")).is_empty());
        let git = problems("x", json!("MIT"), json!("git+https://example.org/x"));
        assert_eq!(git, ["x 1.0.0: comes from git+https://example.org/x"]);
    }

    #[test]
    fn our_own_list_is_readable_and_has_no_copyleft() {
        let deny = read_deny(&crate::root().join("deny.toml")).unwrap();
        let allowed = licensees(&deny.licenses.allow).unwrap();
        for license in ["GPL-2.0-or-later", "GPL-3.0-only", "AGPL-3.0-only", "LGPL-3.0-only"] {
            assert!(license_problem(Some(license), &allowed).is_some(), "{license}");
        }
        assert!(license_problem(Some("MIT OR Apache-2.0"), &allowed).is_none());
    }
}
