//! Checks and generators of this repository; `USAGE` lists them.

mod features;
mod generate;
mod licenses;
mod manuals;
mod metadata;
mod problem;
mod recipes;
mod schemas;
mod site;
mod sources;
mod tidy;
mod versions;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

const USAGE: &str = "\
cargo xtask TASK

  tidy         layers, file lengths, schemas, versions, recipes, links, contents, words and numbers
               of pages, names of stages, paths of machines
  schemas      write docs/formats/schema/ and the version numbers of pages from the code
  features     check that every package compiles dependencies with the features of the whole workspace
  licenses     compare the licenses of all dependencies with deny.toml
  man          write the manual pages of the built stages to target/man/
  fuzz         hostile files, kills and rivals for the built stages: fuzz --minutes N --seed S
  completions  write the shell completions of the built stages to target/completions/
  manuals      check that the flags in docs/stages are those of the built stages
  help-words   check that the help of the built stages has no word that the glossary refuses
  recipes      apply the patches of docs/extending/ to a checkout and run their tests
  site         check the links of the site that `make docs` rendered
";

fn main() -> ExitCode {
    let tasks: Vec<String> = std::env::args().skip(1).collect();
    if tasks.is_empty() || tasks.iter().any(|task| task == "help" || task == "--help") {
        say(USAGE.trim_end());
        return if tasks.is_empty() { ExitCode::from(2) } else { ExitCode::SUCCESS };
    }
    let root = root();
    if tasks[0] == "fuzz" {
        return fuzz(&root, &tasks[1..]);
    }
    for task in &tasks {
        let result = match task.as_str() {
            "tidy" => tidy::run(&root),
            "schemas" => schemas::write(&root).and_then(|()| versions::write(&root)),
            "licenses" | "licences" => licenses::run(&root),
            "features" => features::run(&root),
            "man" => generate::man(&root),
            "completions" => generate::completions(&root),
            "recipes" => recipes::run(&root),
            "site" => site::run(&root),
            "manuals" => manuals::run(&root),
            "help-words" => manuals::help_words(&root),
            _ => {
                say(&format!("xtask: no task \"{task}\"\n{USAGE}"));
                return ExitCode::from(2);
            }
        };
        if let Err(error) = result {
            say(&format!("xtask {task}: {error:#}"));
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// The programs under attack are another package: checks of the repository build without it.
fn fuzz(root: &Path, arguments: &[String]) -> ExitCode {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let ended = Command::new(cargo)
        .args(["run", "--quiet", "--release", "--package", "motes-fuzz", "--"])
        .args(arguments)
        .current_dir(root)
        .status();
    match ended {
        Ok(status) => status
            .code()
            .and_then(|c| u8::try_from(c).ok())
            .map_or(ExitCode::FAILURE, ExitCode::from),
        Err(error) => {
            say(&format!("xtask fuzz: cannot start cargo ({error})"));
            ExitCode::FAILURE
        }
    }
}

/// The workspace: two folders above this package.
fn root() -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    let package = package.unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")));
    package.ancestors().nth(2).unwrap_or(Path::new(".")).to_owned()
}

fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}
