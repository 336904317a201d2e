//! The page in Chromium, as people use it. `make setup-consumers` installs it; without it the test says that it was skipped.

use std::path::PathBuf;

use edit::ops::OpDocument;
use motes_testkit::consumer;
use serde_json::json;

use super::acts::edit;
use super::*;

/// Operations, however their numbers are spelled.
fn ops_of(ops: &Value) -> Vec<OpDocument> {
    serde_json::from_value(ops.clone()).unwrap()
}

#[test]
fn clicks_and_keys_in_chromium_make_the_plan_that_edit_replays_to_what_is_shown() {
    let (Some(browser), Some(_)) = (consumer("chromium"), consumer("node_modules/playwright-core"))
    else {
        return;
    };
    let toy = scene_with_photos();
    let line = ["--scene", "scene", "--capture", "capture.json", "-o", "plan.json"];
    let served = Served::start(toy.folder.path(), &line);
    let view = toy.capture.views[0].name.clone();
    let pictures = std::env::var_os("MOTES_PICTURES").map_or(toy.path("pictures"), PathBuf::from);
    std::fs::create_dir_all(&pictures).unwrap();
    let script =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scripts/consumers/view-page.mjs");
    let url = format!("http://{}{}", served.host(), served.base);
    let mut command = Command::new("node");
    command.arg(script).arg(&pictures).args([&url, &view, "40", "26"]);
    let output = command.current_dir(browser.parent().unwrap()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let (shown, answer) = (&report["milliseconds"], &report["answer"]);
    println!("a click is answered after {answer} ms and highlighted after {shown} ms");
    assert_eq!(report["outside"], serde_json::json!([]), "only the server is asked");
    // The acts, as they were done.
    let steps = report["steps"].as_array().unwrap();
    let ops: Vec<&str> = steps.iter().map(|step| step["op"].as_str().unwrap()).collect();
    assert_eq!(ops, ["select", "set_material", "transform", "set_environment"], "{report}");
    let click = &steps[0]["steps"][0]["clicks"][0];
    assert_eq!(click["view"], view.as_str(), "{click}");
    let pixel: [f64; 2] = serde_json::from_value(click["pixel"].clone()).unwrap();
    assert!((pixel[0] - 40.0).abs() <= 1.0 && (pixel[1] - 26.0).abs() <= 1.0, "{click}");
    assert!(steps[3]["sun"].as_str().unwrap().starts_with("azimuth=1"), "{}", steps[3]);
    let said = report["copied"].as_str().unwrap();
    assert!(
        said.starts_with("motes edit --scene /") && said.contains("--plan edit-plan.json"),
        "{said}"
    );
    // On a small screen nothing is beside the screen, and the plan is the same.
    assert_eq!(report["phone"]["wide"], 390, "{report}");
    assert_eq!(report["phone"]["steps"], 4, "{report}");
    // The plan that the browser saved makes what it shows.
    let plan = pictures.join("edit-plan.json");
    let saved: Value = serde_json::from_slice(&std::fs::read(&plan).unwrap()).unwrap();
    assert_eq!(ops_of(&saved["ops"]), ops_of(&report["steps"]));
    edit(&toy, &["--plan", plan.to_str().unwrap(), "-o", "replayed"]);
    let shown = served.get("gaussians").body;
    let written = |folder: &str| std::fs::read(toy.path(folder).join("gaussians.ply")).unwrap();
    assert!(shown == written("replayed"), "the page shows something else");
    // The same acts, typed, are the same plan.
    let keys = json!({ "id": steps[0]["id"], "steps": steps[0]["steps"] }).to_string();
    let moved: Vec<String> =
        steps[2]["translate"].as_array().unwrap().iter().map(Value::to_string).collect();
    let (moved, sun) = (moved.join(","), steps[3]["sun"].as_str().unwrap());
    let material = ["--set-material", "brass", "--translate", &moved, "--set-sun", sun];
    edit(&toy, &[&["--select", &keys][..], &material, &["-o", "typed"]].concat());
    let log = std::fs::read(toy.path("typed/edit-log.json")).unwrap();
    let log: Value = serde_json::from_slice(&log).unwrap();
    assert_eq!(ops_of(&log["ops"]), ops_of(&saved["ops"]));
    assert!(shown == written("typed"), "the typed plan makes something else");
    // The browser is gone; the server is not.
    assert_eq!(served.quit().status.code(), Some(0));
}
