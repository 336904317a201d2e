//! import-colmap as a user meets it: command lines, exit codes, what is on stdout and on disk.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;

use motes_formats::capture::read_capture;
use motes_formats::images::write_png;
use motes_scene::{ImageU8, Split};
use serde_json::Value;

const CAMERAS: &str = "1 SIMPLE_RADIAL 64 48 60 32 24 0.05\n";
const POINTS: &str = "1 0 0 3 9 8 7 0.5 1 0 2 0\n2 0.1 0 3 9 8 7 0.5 1 1 2 1\n";

fn tool(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_import-colmap"));
    command.args(arguments).env_remove("MOTES_PYTHON").output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Expects an exit code and a piece of what is said on stderr.
fn expect(output: &Output, code: i32, said: &str) {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    assert!(stderr.contains(said), "{said}: {stderr}");
}

/// A project with nine photos; the model at `model`.
fn project(model: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join(model);
    std::fs::create_dir_all(&model).unwrap();
    let mut images = String::new();
    for i in 1..=9 {
        let name = format!("photo {i}.png");
        images.push_str(&format!(
            "{i} 1 0 0 0 {} 0 0 1 {name}\n32 24 1 34 24 2\n",
            -0.1 * f64::from(i)
        ));
        let path = folder.path().join("images").join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        write_png(&path, &ImageU8::filled(64, 48, 3, 20 * i as u8)).unwrap();
    }
    std::fs::write(model.join("cameras.txt"), CAMERAS).unwrap();
    std::fs::write(model.join("images.txt"), images).unwrap();
    std::fs::write(model.join("points3D.txt"), POINTS).unwrap();
    folder
}

fn shown(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_project_becomes_a_capture() {
    for model in ["sparse/0", "sparse", "."] {
        let folder = project(model);
        let out = folder.path().join("capture");
        std::fs::create_dir(&out).unwrap();
        let output = tool(&[
            shown(folder.path()),
            "-o",
            shown(&out),
            "--max-resolution",
            "32",
            "--test-every",
            "8",
        ]);
        expect(&output, 0, "9 of 9 registered");
        assert!(output.stdout.is_empty(), "stdout is for data");
        let capture = read_capture(&out.join("capture.json")).unwrap();
        let test: Vec<&str> =
            capture.views_of(Split::Test).iter().map(|&i| capture.views[i].name.as_str()).collect();
        assert_eq!(test, ["photo 1.png", "photo 9.png"]);
        assert_eq!((capture.cameras[0].width, capture.cameras[0].height), (32, 24));
        assert_eq!(capture.points.len(), 2);
        assert!(capture.views.iter().all(|view| out.join(&view.image).is_file()));
    }
}

#[test]
fn model_and_images_are_given_apart_and_the_report_is_json() {
    let folder = project("elsewhere");
    let (model, images) = (folder.path().join("elsewhere"), folder.path().join("images"));
    let out = folder.path().join("a/b");
    let arguments =
        ["--model", shown(&model), "--images", shown(&images), "-o", shown(&out), "--json"];
    let output = tool(&arguments);
    expect(&output, 0, "");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((report["registered"].as_u64(), report["points"].as_u64()), (Some(9), Some(2)));
    expect(&tool(&arguments), 2, "exists already");
    expect(&tool(&[&arguments[..], &["--overwrite"]].concat()), 0, "");
    expect(&tool(&["--model", shown(&model), "-o", shown(&out), "-w"]), 0, "");
}

#[test]
fn the_result_does_not_depend_on_threads() {
    let folder = project("sparse/0");
    let files = |threads: &str| {
        let out = folder.path().join(format!("out{threads}"));
        expect(&tool(&[shown(folder.path()), "-o", shown(&out), "-j", threads]), 0, "");
        let read = |name: &str| std::fs::read(out.join(name)).unwrap();
        [read("capture.json"), read("points.ply"), read("images/photo 5.png")]
    };
    assert_eq!(files("1"), files("3"));
}

#[test]
fn wrong_command_lines_say_what_to_do() {
    let folder = project("sparse/0");
    let out = folder.path().join("out");
    expect(&tool(&["-o", shown(&out)]), 2, "required");
    expect(&tool(&["--photos", "-o", shown(&out)]), 2, "--photos");
    let images = folder.path().join("images");
    expect(&tool(&[shown(&images), "-o", shown(&out)]), 3, "add --photos");
    expect(&tool(&[shown(&folder.path().join("nothing")), "-o", shown(&out)]), 3, "no such");
    expect(&tool(&[shown(folder.path()), "-o", shown(folder.path())]), 2, "overwrite");
    let every = ["--test-every", "1"];
    expect(
        &tool(&[&[shown(folder.path()), "-o", shown(&out)][..], &every].concat()),
        2,
        "test-every",
    );
    assert!(!out.join("capture.json").exists());
}

#[test]
fn a_missing_solver_is_a_failure_with_the_remedy() {
    let folder = project("sparse/0");
    let (images, out) = (folder.path().join("images"), folder.path().join("out"));
    let python = folder.path().join("no-python");
    for photos in [vec![shown(&images), "--photos"], vec!["--photos", shown(&images)]] {
        let rest = ["-o", shown(&out), "--sfm", "pycolmap", "--python", shown(&python)];
        expect(&tool(&[photos, rest.to_vec()].concat()), 1, "pip install -r requirements.txt");
    }
}

#[test]
fn every_malformed_model_ends_in_one_error_within_a_second() {
    let corpus = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../testdata/colmap/invalid");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut cases = 0;
    for entry in std::fs::read_dir(corpus).unwrap() {
        let model = entry.unwrap().path();
        if !model.is_dir() {
            continue;
        }
        let expected = std::fs::read_to_string(model.with_extension("expect")).unwrap();
        let started = Instant::now();
        let arguments =
            ["--model", shown(&model), "--images", shown(folder.path()), "-o", shown(&out)];
        let output = tool(&arguments);
        assert!(started.elapsed().as_secs_f64() < 1.0, "{}", model.display());
        // A folder without a whole model is told apart before it is read.
        let said = if model.ends_with("no-images") { "neither" } else { expected.trim() };
        expect(&output, 3, said);
        assert!(!text(&output.stderr).contains("panic"));
        assert!(output.stdout.is_empty() && !out.join("capture.json").exists());
        cases += 1;
    }
    assert!(cases >= 40, "{cases} cases");
}

#[test]
fn help_teaches_by_example() {
    let help = text(&tool(&["--help"]).stdout);
    for part in ["Examples:", "--photos", "--test-every", "--sfm", "Exit codes"] {
        assert!(help.contains(part), "{part}");
    }
}

/// A killed import takes the solver along: it holds the solver's standard input open as long as it lives.
#[cfg(unix)]
#[test]
fn the_solver_ends_with_an_import_that_is_killed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // The folder is called like an option.
    std::fs::create_dir(at("--seed")).unwrap();
    std::fs::write(at("--seed/a.png"), "x").unwrap();
    let script = format!(
        "#!/bin/sh\n[ \"$1\" = -c ] && exit 0\necho \"$@\" > {0}/line\necho $TMPDIR > {0}/begun\ncat > {0}/heard\ntouch {0}/ended\n",
        folder.path().display()
    );
    // Written by a process of its own: one that another test forks meanwhile would hold the file open, and it could not be run.
    let write = ["-c", "printf %s \"$1\" > python && chmod 755 python", "sh", &script];
    assert!(Command::new("sh").args(write).current_dir(folder.path()).status().unwrap().success());
    let mut child = Command::new(env!("CARGO_BIN_EXE_import-colmap"))
        .args(["--photos=--seed", "-o", "out", "-q"])
        .args(["--python", shown(&at("python"))])
        .current_dir(folder.path())
        .spawn()
        .unwrap();
    let wait_for = |name: &str| {
        let began = std::time::Instant::now();
        while std::fs::metadata(at(name)).is_err() {
            assert!(began.elapsed().as_secs() < 30, "no {name}");
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        std::fs::read_to_string(at(name)).unwrap()
    };
    let temporary = wait_for("begun");
    assert!(temporary.contains(".motes-"), "logs would go to {temporary}");
    let line = std::fs::read_to_string(at("line")).unwrap();
    assert!(line.contains("/--seed ") && line.contains("--end-with-parent"), "{line}");
    child.kill().unwrap();
    child.wait().unwrap();
    wait_for("ended");
    // Its folder goes with the next import, at the latest.
    let scratch = std::path::PathBuf::from(temporary.trim());
    motes_formats::atomic::remove_stale(scratch.parent().unwrap());
    assert!(!scratch.exists());
}
