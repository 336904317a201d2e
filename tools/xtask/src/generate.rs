//! Manual pages and completions, asked from the built stages.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, bail, ensure};

pub(crate) fn man(root: &Path) -> anyhow::Result<()> {
    let folder = root.join("target/man");
    for stage in built_stages(root)? {
        let page = ask(&stage, "man")?;
        save(&folder.join(format!("motes-{}.1", name(&stage))), &page)?;
    }
    crate::say("man: wrote target/man/");
    Ok(())
}

pub(crate) fn completions(root: &Path) -> anyhow::Result<()> {
    let folder = root.join("target/completions");
    for stage in built_stages(root)? {
        let name = name(&stage);
        for (shell, file) in [
            ("bash", format!("{name}.bash")),
            ("zsh", format!("_{name}")),
            ("fish", format!("{name}.fish")),
        ] {
            save(&folder.join(shell).join(file), &ask(&stage, shell)?)?;
        }
    }
    crate::say("completions: wrote target/completions/");
    Ok(())
}

/// Names of the stages that the workspace builds: the crates with a program and a command line.
pub(crate) fn stage_names(root: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(root.join("crates")) else {
        return Vec::new();
    };
    let mut names: Vec<String> = entries
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            let is_stage = path.join("src/main.rs").exists() && path.join("src/files").is_dir();
            is_stage.then(|| path.file_name()?.to_str().map(str::to_owned))?
        })
        .collect();
    names.sort();
    names
}

/// The programs `motes-NAME` of the crates `provider-NAME`, which stages start and `motes` does not list; the one apart where it was built.
pub(crate) fn built_providers(root: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let folder = root.join("target/release");
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(root.join("crates"))? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name.starts_with("provider-") {
            let path = folder.join(format!("motes-{name}{}", std::env::consts::EXE_SUFFIX));
            if name == crate::features::APART && !path.exists() {
                continue;
            }
            ensure!(path.exists(), "run `make` first: it builds {}", path.display());
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

pub(crate) fn built_stages(root: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let names = stage_names(root);
    ensure!(!names.is_empty(), "there is no stage in crates/");
    let folder = root.join("target/release");
    let paths = names.iter().map(|n| folder.join(format!("{n}{}", std::env::consts::EXE_SUFFIX)));
    let paths: Vec<PathBuf> = paths.collect();
    match paths.iter().find(|path| !path.exists()) {
        Some(missing) => bail!("run `make` first: it builds {}", missing.display()),
        None => Ok(paths),
    }
}

fn name(stage: &Path) -> String {
    stage.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn ask(stage: &Path, what: &str) -> anyhow::Result<Vec<u8>> {
    let output = Command::new(stage).args(["--generate", what]).output()?;
    let shown = stage.display();
    ensure!(output.status.success() && !output.stdout.is_empty(), "no {what} from {shown}");
    Ok(output.stdout)
}

fn save(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
    std::fs::write(path, bytes).with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_the_crates_with_a_program_and_a_command_line() {
        let dir = tempfile::tempdir().unwrap();
        assert!(built_stages(dir.path()).is_err());
        for (name, folder, file) in [
            ("render", "src/files", "src/main.rs"),
            ("evaluate", "src/files", "src/main.rs"),
            ("motes", "src", "src/main.rs"),
            ("math", "src/files", "src/lib.rs"),
        ] {
            let package = dir.path().join("crates").join(name);
            std::fs::create_dir_all(package.join(folder)).unwrap();
            std::fs::write(package.join(file), "").unwrap();
        }
        assert_eq!(stage_names(dir.path()), ["evaluate", "render"]);
        let error = built_stages(dir.path()).unwrap_err().to_string();
        assert!(error.contains("run `make` first"), "{error}");
    }
}
