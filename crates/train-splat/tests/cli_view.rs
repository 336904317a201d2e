//! `--view` starts the program `view` and leaves its page open after a fit that succeeded.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Command, Output};

use motes_testkit::toy_capture::{ToyCapture, assert_code, stderr, toy_capture};

/// Stands for `view`: notes its arguments, tells an address, looks for snapshots, and goes on until `done` is there.
const STAND_IN: &str = r#"#!/bin/sh
printf '%s\n' "$@" > arguments
echo '{"url": "http://127.0.0.1:9/?token=00"}'
i=0
while [ $i -lt 3000 ] && [ ! -e done ]; do
    ls | grep '[.]step-' >> seen
    i=$((i + 1))
    sleep 0.02
done
echo ended > ended
"#;

fn train(toy: &ToyCapture, extra: &[&str]) -> Output {
    let folder = toy.folder.path();
    let program = folder.join("stages/view");
    std::fs::create_dir_all(program.parent().unwrap()).unwrap();
    std::fs::write(&program, STAND_IN).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    Command::new(env!("CARGO_BIN_EXE_train-splat"))
        .args(["--capture", "capture.json", "--init-ply", "true.ply", "--no-provenance"])
        .args(["-o", "g.ply"])
        .args(extra)
        .env("MOTES_STAGE_PATH", folder.join("stages"))
        .current_dir(folder)
        .output()
        .unwrap()
}

fn snapshots(folder: &Path) -> usize {
    let all = std::fs::read_dir(folder).unwrap().flatten();
    all.filter(|entry| entry.file_name().to_string_lossy().contains(".step-")).count()
}

#[test]
fn a_page_follows_the_fit_and_stays() {
    let toy = toy_capture();
    let folder = toy.folder.path();
    let output = train(&toy, &["--view", "--no-browser", "-n=1500"]);
    assert_code(&output, 0);
    let text = stderr(&output);
    assert!(text.contains("http://127.0.0.1:9/?token=00"), "{text}");
    assert!(text.contains("the page stays until you end it there"), "{text}");
    let arguments = std::fs::read_to_string(folder.join("arguments")).unwrap();
    let words: Vec<&str> = arguments.lines().collect();
    let expected = ["--gaussians", "g.ply", "--capture", "capture.json"];
    assert_eq!(words, [&expected[..], &["--wait", "--json", "--quiet", "--no-browser"]].concat());
    let seen = std::fs::read_to_string(folder.join("seen")).unwrap();
    assert!(seen.contains("g.step-00"), "no snapshot was there to be seen");
    assert_eq!(snapshots(folder), 0, "snapshots for a look do not stay");
    assert!(!folder.join("ended").exists(), "the page ended with the fit");
    std::fs::write(folder.join("done"), "").unwrap();
    for _ in 0..200 {
        if folder.join("ended").exists() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    panic!("the page was not left running");
}

#[test]
fn snapshots_that_were_asked_for_stay() {
    let toy = toy_capture();
    let output = train(&toy, &["--view", "--no-browser", "-n=40", "--export-every=10"]);
    std::fs::write(toy.folder.path().join("done"), "").unwrap();
    assert_code(&output, 0);
    assert_eq!(snapshots(toy.folder.path()), 4);
}

#[test]
fn no_browser_needs_view() {
    let toy = toy_capture();
    assert_code(&train(&toy, &["--no-browser", "-n=10"]), 2);
}
