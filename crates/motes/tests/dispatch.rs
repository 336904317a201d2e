//! The dispatcher from outside, with shell scripts in place of stages.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot set up its folders has failed")]

use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// An installation of its own: `bin/motes`, `libexec/motes/`, an override folder, a `PATH` folder.
struct Install {
    root: tempfile::TempDir,
    /// One test at a time: a process that another test starts inherits the script that this one
    /// has open for writing, for a moment, and the kernel refuses to run it meanwhile.
    _alone: MutexGuard<'static, ()>,
}

static ALONE: Mutex<()> = Mutex::new(());

impl Install {
    fn new() -> Self {
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let install = Self { root: tempfile::tempdir().unwrap(), _alone: alone };
        for folder in ["bin", "libexec/motes", "override", "path"] {
            std::fs::create_dir_all(install.at(folder)).unwrap();
        }
        std::fs::copy(env!("CARGO_BIN_EXE_motes"), install.at("bin/motes")).unwrap();
        install
    }

    fn at(&self, place: &str) -> PathBuf {
        self.root.path().canonicalize().unwrap().join(place)
    }

    fn script(&self, place: &str, body: &str) -> PathBuf {
        let path = self.at(place);
        std::fs::write(&path, format!("#!/bin/sh\n{body}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(self.at("bin/motes"))
            .args(arguments)
            .env("PATH", self.at("path"))
            .env("MOTES_STAGE_PATH", self.at("override"))
            .output()
            .unwrap()
    }

    fn which(&self, stage: &str) -> PathBuf {
        let output = self.run(&["which", stage]);
        assert!(output.status.success(), "{output:?}");
        Path::new(text(&output.stdout).trim_end()).canonicalize().unwrap()
    }
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

#[test]
fn places_are_searched_in_order() {
    let install = Install::new();
    for place in ["path/motes-render", "libexec/motes/render", "bin/render", "override/render"] {
        let expected = install.script(place, "exit 0");
        assert_eq!(install.which("render"), expected);
    }
}

#[test]
fn a_file_that_cannot_run_is_passed_over() {
    let install = Install::new();
    let real = install.script("libexec/motes/render", "exit 0");
    std::fs::write(install.at("override/render"), "not a program").unwrap();
    std::fs::create_dir(install.at("bin/render")).unwrap();
    assert_eq!(install.which("render"), real);
}

#[test]
fn a_link_to_the_dispatcher_finds_the_stages_of_its_target() {
    let install = Install::new();
    let stage = install.script("libexec/motes/render", "exit 0");
    let link = install.at("elsewhere");
    std::os::unix::fs::symlink(install.at("bin/motes"), &link).unwrap();
    let output = Command::new(link).args(["which", "render"]).output().unwrap();
    assert_eq!(Path::new(text(&output.stdout).trim_end()).canonicalize().unwrap(), stage);
}

#[test]
fn the_stage_takes_over() {
    let install = Install::new();
    install.script("libexec/motes/export", "echo \"$MOTES_INVOKED_AS|$#|$2\"; exit 3");
    let output = install.run(&["export", "-o", "a b.glb"]);
    assert_eq!(text(&output.stdout), "motes export|2|a b.glb\n");
    assert_eq!(output.status.code(), Some(3));
}

#[test]
fn signals_pass_unchanged() {
    let install = Install::new();
    install.script("libexec/motes/render", "kill -TERM $$");
    assert_eq!(install.run(&["render"]).status.signal(), Some(15));
}

#[test]
fn an_unknown_verb_exits_2_and_suggests() {
    let install = Install::new();
    install.script("bin/train-splat", "exit 0");
    let output = install.run(&["trian-splat"]);
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(2), ""));
    let expected =
        "motes: there is no stage \"trian-splat\"\nhelp: did you mean motes train-splat?\n";
    assert_eq!(text(&output.stderr), expected);
    // A stage of the suite that is not there is unknown like any other.
    assert_eq!(install.run(&["decompose"]).status.code(), Some(2));
    for verb in ["../bin/train-splat", "/bin/sh", "--nope", "motes"] {
        assert_eq!(install.run(&[verb]).status.code(), Some(2), "{verb}");
    }
    assert_eq!(install.run(&["which"]).status.code(), Some(2));
}

#[test]
fn help_lists_only_what_is_there_in_pipeline_order() {
    let install = Install::new();
    for (place, summary) in [
        ("bin/evaluate", "Measure renders"),
        ("libexec/motes/train-splat", "Fit Gaussians"),
        ("path/motes-denoise", "A third party"),
    ] {
        install.script(place, &format!("[ \"$1\" = --summary ] && echo '{summary}'"));
    }
    for arguments in [&[][..], &["help"], &["--help"]] {
        let output = install.run(arguments);
        let help = text(&output.stdout);
        assert!(output.status.success() && output.stderr.is_empty());
        let position = |word: &str| help.find(word).unwrap_or_else(|| panic!("{word}: {help}"));
        assert!(position("Model\n  train-splat      Fit Gaussians") < position("Measure\n"));
        assert!(position("  evaluate         Measure renders") < position("Other\n  denoise"));
        assert!(!help.contains("decompose") && !help.contains("Input"));
    }
    let list = install.run(&["list"]);
    assert_eq!(text(&list.stdout), "train-splat\nevaluate\ndenoise\n");
}

#[test]
fn help_of_a_stage_asks_the_stage() {
    let install = Install::new();
    install.script("bin/render", "echo \"$MOTES_INVOKED_AS $*\"");
    assert_eq!(text(&install.run(&["help", "render"]).stdout), "motes render --help\n");
}

#[test]
fn a_swapped_stage_reaches_the_pipelines() {
    let install = Install::new();
    let marker = install.at("ran");
    let stage = format!("echo \"$1\" > '{}'; exit 3", marker.display());
    install.script("override/import-colmap", &stage);
    let lab = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../pipelines/lab");
    let output = Command::new("make")
        .arg("-C")
        .arg(lab)
        .arg(format!("BIN={}", install.at("bin").display()))
        .arg(format!("OUT={}", install.at("out").display()))
        .env("MOTES_STAGE_PATH", install.at("override"))
        .output()
        .unwrap();
    assert!(!output.status.success(), "the stage failed, so the pipeline must");
    assert_eq!(std::fs::read_to_string(marker).unwrap(), "--photos\n");
}

#[test]
fn the_stage_of_the_documentation_takes_the_place_of_ours() {
    let install = Install::new();
    install.script("bin/train-splat", "echo \"$*\"");
    let stages = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/extending/stages");
    let output = Command::new(install.at("bin/motes"))
        .args(["train-splat", "--capture", "capture.json"])
        .env("MOTES_STAGE_PATH", stages)
        .env("MOTES_BIN", install.at("bin"))
        .output()
        .unwrap();
    assert_eq!(text(&output.stdout), "--loss-term edge=0.1 --capture capture.json\n", "{output:?}");
}

#[test]
fn completions_of_a_stage_are_completions_of_motes() {
    let install = Install::new();
    install.script(
        "bin/render",
        "[ \"$MOTES_INVOKED_AS $*\" = \"motes render --generate bash\" ] || exit 1\n\
         echo '_motes__render() { COMPREPLY=(\"$1:${COMP_WORDS[0]}:$COMP_CWORD\"); }'",
    );
    install.script("path/motes-denoise", "echo must-not-run >&2; exit 1");
    let script = install.run(&["completions", "bash"]);
    assert!(script.status.success(), "{script:?}");
    let complete = |words: &str, at: usize| {
        let line = format!(
            "{}\nCOMP_WORDS=({words}); COMP_CWORD={at}\n\
             _motes motes \"${{COMP_WORDS[{at}]}}\"\necho \"${{COMPREPLY[@]}}\"",
            text(&script.stdout)
        );
        let done = Command::new("bash").args(["-c", &line]).output().unwrap();
        assert!(done.stderr.is_empty(), "{done:?}");
        text(&done.stdout).trim_end().to_owned()
    };
    assert_eq!(complete("motes re", 1), "render");
    assert_eq!(complete("motes de", 1), "denoise");
    assert_eq!(complete("motes help ren", 2), "render");
    assert_eq!(complete("motes render --sp", 2), "render:render:1");
    assert_eq!(complete("motes denoise --sp", 2), "");
    let other = install.run(&["completions", "tcsh"]);
    assert_eq!(other.status.code(), Some(2));
}
