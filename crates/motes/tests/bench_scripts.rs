//! The benchmark scripts, end to end on the bundled photos, with the programs of this build.
//!
//! They need Python, as importing photos does; a machine without it skips them and says so.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn programs() -> &'static Path {
    Path::new(motes_testkit::program("train-splat")).parent().expect("a program lies in a folder")
}

/// Runs Python in the root of the repository; `None` where there is no Python 3.9.
fn python(arguments: &[&str]) -> Option<Output> {
    let has = "import sys; sys.exit(sys.version_info < (3, 9))";
    if !Command::new("python3").args(["-c", has]).status().is_ok_and(|status| status.success()) {
        #[allow(clippy::print_stderr, reason = "a test that skips says so")]
        {
            eprintln!("skipped: no python3, or older than 3.9");
        }
        return None;
    }
    let output = Command::new("python3").current_dir(root()).args(arguments).output();
    Some(output.expect("python3 ran a moment ago"))
}

#[track_caller]
fn assert_success(output: &Output) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{text}", output.status);
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The one file of a folder whose name ends like this.
fn file(folder: &Path, end: &str) -> PathBuf {
    let entries = std::fs::read_dir(folder).expect("the script made its folder");
    let mut paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let found = paths.find(|path| path.to_string_lossy().ends_with(end));
    found.unwrap_or_else(|| panic!("no *{end} in {}", folder.display()))
}

#[test]
fn parts_of_the_sweep_do_what_they_say() {
    let Some(output) = python(&["-m", "unittest", "discover", "-s", "scripts/bench/tests"]) else {
        return;
    };
    assert_success(&output);
    // An empty discovery succeeds on older Pythons.
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("Ran ") && !said.contains("Ran 0 tests"), "{said}");
}

#[test]
fn providers_in_python_keep_the_protocol_without_their_models() {
    let tests = ["-m", "unittest", "discover", "-s", "scripts/providers/tests"];
    let Some(output) = python(&tests) else { return };
    assert_success(&output);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("Ran ") && !said.contains("Ran 0 tests"), "{said}");
}

#[test]
fn every_declared_dial_runs_and_the_record_is_whole() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    let bin = programs().to_str().unwrap();
    let script = "scripts/bench/tradeoff";
    let Some(output) = python(&[script, "--smoke", "--bin", bin, "--out", folder]) else { return };
    assert_success(&output);
    let record: serde_json::Value =
        serde_json::from_str(&text(&file(out.path(), "-tradeoff.json"))).unwrap();
    assert_eq!(record["failed"], serde_json::json!([]));
    assert_eq!(record["missing"], serde_json::json!([]));
    let rows = record["rows"].as_array().unwrap();
    for stage in ["train-splat", "render"] {
        assert!(rows.iter().any(|row| row["stage"] == stage && row["front"] == true), "{stage}");
    }
    for row in rows {
        assert!(row["metrics"]["psnr_test"]["mean"].as_f64().unwrap() > 5.0, "{row}");
        assert!(row["metrics"]["cpu_seconds"]["mean"].as_f64().unwrap() > 0.0, "{row}");
    }
    assert!(text(&file(out.path(), "-tradeoff.svg")).contains("class=\"preset\""));
}

#[test]
fn an_unknown_flag_is_an_error_that_names_it() {
    // Any other program stands for one whose flags were renamed.
    let folder = tempfile::tempdir().unwrap();
    for name in ["train-splat", "render", "evaluate", "import-colmap"] {
        let source = programs().join(if name == "train-splat" { "render" } else { name });
        std::fs::copy(source, folder.path().join(name)).unwrap();
    }
    let bin = folder.path().to_str().unwrap();
    let script = "scripts/bench/tradeoff";
    let Some(output) = python(&[script, "--list", "--bin", bin]) else { return };
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("--max-gaussians of dial train-splat/max-gaussians"), "{said}");
}

#[test]
fn cost_curves_are_measured_and_fitted() {
    let bin = programs().to_str().unwrap();
    let Some(output) = python(&["scripts/bench/cost", "--smoke", "--bin", bin]) else { return };
    assert_success(&output);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    for curve in ["pixels of a photo", "Gaussians", "training views"] {
        assert!(said.contains(&format!("training step grows with {curve} to the power")), "{said}");
    }
    assert!(said.contains("a step with 2 threads"), "{said}");
}

#[test]
fn captures_run_through_the_stages_once() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    let bin = programs().to_str().unwrap();
    let mut words =
        vec!["scripts/bench/captures", "--data", "testdata/captures/tiny", "-o", folder];
    words.extend(["--bin", bin, "--preset", "draft", "--preset", "balanced"]);
    words.extend(["--train-flag=--iterations=24", "--train-flag=--max-gaussians=400"]);
    let Some(output) = python(&words) else { return };
    assert_success(&output);
    let page = text(&out.path().join("captures.md"));
    assert!(page.contains("- tiny: 7 training photos, 2 held out"), "{page}");
    let record: serde_json::Value =
        serde_json::from_str(&text(&out.path().join("captures.json"))).unwrap();
    let rows = record["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    for row in rows {
        assert!(row["psnr"].as_f64().unwrap() > 12.0, "{row}");
        for stage in ["import", "train", "evaluate"] {
            assert!(row["stages"][stage]["peak_bytes"].as_f64().unwrap() > 1e6, "{row}");
        }
    }
    let sheet = std::fs::read(out.path().join("sheets/tiny.png")).unwrap();
    assert!(sheet.starts_with(b"\x89PNG") && sheet.len() > 5000, "{} bytes", sheet.len());
    assert!(text(&out.path().join("pareto.svg")).contains("class=\"preset\""));
    let again = python(&words).expect("there was a Python");
    assert_success(&again);
    let said = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(said.contains("0 cells run"), "{said}");
}
