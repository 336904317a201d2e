//! A training run as it goes.

use std::fs;

use motes_formats::ply::{PlyWriteOptions, write_gaussians};
use motes_testkit::random_gaussians;
use serde_json::json;

use super::*;

fn write(folder: &Path, name: &str, count: usize) {
    let gaussians = random_gaussians(count as u64, count, 1);
    write_gaussians(&folder.join(name), &gaussians, &PlyWriteOptions::default()).unwrap();
}

fn drawn(state: &Value) -> u64 {
    state["drawn"]["splat"]["count"].as_u64().unwrap()
}

#[test]
fn newer_snapshots_are_shown_until_somebody_acts() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "model.step-000100.ply", 40);
    // The product is not there yet.
    let served = Served::start(folder, &["--gaussians", "model.ply"]);
    let first = drawn(&served.state());
    assert!(first > 0);
    let command = |state: &Value| state["command"].as_array().unwrap()[3].to_string();
    assert!(command(&served.state()).contains("step-000100"));
    std::thread::sleep(Duration::from_millis(50));
    write(folder, "model.step-000200.ply", 80);
    let state = served.wait("reloaded", |state| drawn(state) > first);
    assert!(command(&state).contains("step-000200"), "{state}");
    // A file that is broken is said, and what was shown stays.
    std::thread::sleep(Duration::from_millis(50));
    fs::write(folder.join("model.step-000300.ply"), "ply\n").unwrap();
    let state = served.wait("told", |state| state["notice"].is_string());
    assert_eq!(drawn(&state), drawn(&served.state()));
    // Nothing is lost that somebody did.
    let point = json!({ "kind": "click", "point": [0, 0, 0], "eye": [0, 0, 5], "positive": true });
    served.act("prompt", &point);
    served.act("keep", &json!({ "name": "mine" }));
    write(folder, "model.ply", 120);
    let told = |state: &Value| state["notice"].as_str().is_some_and(|n| n.contains("written anew"));
    let state = served.wait("told", told);
    assert_eq!(state["selections"], json!(["mine"]));
    served.act("undo", &json!({}));
    let state = served.wait("reloaded", |state| state["notice"].is_null());
    assert!(command(&state).contains("model.ply"), "{state}");
}

#[test]
fn a_run_that_has_just_begun_is_waited_for_and_found_by_its_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("model.checkpoint.safetensors"), "not a model").unwrap();
    let line = ["--gaussians", "model.checkpoint.safetensors"];
    let refused = run(folder, &line);
    assert_eq!(refused.status.code(), Some(3));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        said.contains("no snapshot beside the checkpoint") && said.contains("--wait"),
        "{said}"
    );
    let late = std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(700));
            write(folder, "model.step-000100.ply", 40);
        });
        Served::start(folder, &[&line[..], &["--wait"]].concat())
    });
    let first = drawn(&late.state());
    assert!(first > 0);
    std::thread::sleep(Duration::from_millis(50));
    write(folder, "model.ply", 80);
    late.wait("reloaded", |state| drawn(state) > first);
}
