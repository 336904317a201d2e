//! Acts of the page are steps of a plan, and `edit` makes of the plan what the page shows.

use motes_testkit::program;
use serde_json::json;

use super::*;

pub(crate) const SCENE: [&str; 4] = ["--scene", "scene", "--capture", "capture.json"];

/// Runs `edit` in the folder of the scene.
#[track_caller]
pub(crate) fn edit(toy: &ToyScene, arguments: &[&str]) {
    let mut command = Command::new(program("edit"));
    command.args(SCENE).args(["--no-provenance", "-q"]).args(arguments);
    let output = command.current_dir(toy.folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The name of the first view, and a pixel of it that shows the box.
pub(crate) fn on_the_box(toy: &ToyScene) -> (String, [f64; 2]) {
    shown_at(toy, [0.1, 0.0, 0.6])
}

/// The name of the first view, and its pixel of a point.
fn shown_at(toy: &ToyScene, point: [f64; 3]) -> (String, [f64; 2]) {
    let view = &toy.capture.views[0];
    let camera = toy.capture.cameras[view.camera].as_pinhole().unwrap();
    let p = view.camera_from_world.transform_point(point.into());
    let pixel = [camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy];
    (view.name.clone(), pixel.map(f64::floor))
}

#[track_caller]
fn assert_same_bytes(toy: &ToyScene, served: &Served, folder: &str) {
    let page = served.get("gaussians");
    assert_eq!(page.code, 200, "{}", String::from_utf8_lossy(&page.body));
    let written = std::fs::read(toy.path(folder).join("gaussians.ply")).unwrap();
    assert!(page.body == written, "{} and {} bytes differ", page.body.len(), written.len());
}

#[test]
fn the_plan_of_the_page_is_that_of_the_command_line_and_makes_what_the_page_shows() {
    let toy = scene_with_photos();
    let served = Served::start(toy.folder.path(), &[&SCENE[..], &["-o", "plan.json"]].concat());
    served.wait("ready", |state| state["views"] == "ready");
    let (view, pixel) = on_the_box(&toy);
    let click = json!({ "kind": "click", "view": view, "pixel": pixel, "positive": true });
    let state = served.act("prompt", &click);
    assert!(state["selection"]["count"].as_u64().unwrap() > 100, "{state}");
    assert!(state["mask"].is_string(), "{state}");
    served.act("act", &json!({ "op": { "op": "set_material", "name": "brass" } }));
    served.act("act", &json!({ "op": { "op": "transform", "translate": [0.6, 0.2, 0.0] } }));
    served.act("light", &json!({ "sun": "azimuth=40,elevation=35" }));
    // A click sees what was moved where it is now.
    let (_, moved) = shown_at(&toy, [0.7, 0.2, 0.6]);
    let click = json!({ "kind": "click", "view": view, "pixel": moved, "positive": true });
    let again = served.act("prompt", &click)["selection"]["count"].as_u64().unwrap();
    assert!(again > 100, "{again}");
    served.act("act", &json!({ "op": { "op": "set_material", "name": "oak" } }));
    let state = served.settled();
    assert_eq!(state["steps"].as_array().unwrap().len(), 6, "{state}");
    // What is saved replays to what is shown.
    let saved = served.get("plan");
    std::fs::write(toy.path("saved.json"), &saved.body).unwrap();
    edit(&toy, &["--plan", "saved.json", "-o", "replayed"]);
    assert_same_bytes(&toy, &served, "replayed");
    // The same by flags is the same plan.
    let place = |[x, y]: [f64; 2]| format!("click={view},{x},{y}");
    let words = [
        "--select",
        &place(pixel),
        "--set-material",
        "brass",
        "--translate",
        "0.6,0.2,0",
        "--set-sun",
        "azimuth=40,elevation=35",
        "--select",
        &place(moved),
        "--set-material",
        "oak",
        "-o",
        "typed",
    ];
    edit(&toy, &words);
    let log = std::fs::read(toy.path("typed/edit-log.json")).unwrap();
    let log: Value = serde_json::from_slice(&log).unwrap();
    assert_eq!(saved.json()["ops"], log["ops"]);
    assert_same_bytes(&toy, &served, "typed");
    // The plan is in the file, too, and the program ends well.
    let done = served.quit();
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    let written: Value =
        serde_json::from_slice(&std::fs::read(toy.path("plan.json")).unwrap()).unwrap();
    assert_eq!(written["ops"], log["ops"]);
    assert_eq!(String::from_utf8_lossy(&done.stdout).trim(), r#"{"acts":6,"output":"plan.json"}"#);
}

#[test]
fn further_clicks_refine_and_a_name_keeps() {
    let toy = scene_with_photos();
    let served = Served::start(toy.folder.path(), &SCENE);
    served.wait("ready", |state| state["views"] == "ready");
    let (view, pixel) = on_the_box(&toy);
    let at = |pixel: [f64; 2], positive: bool| json!({ "kind": "click", "view": view, "pixel": pixel, "positive": positive });
    let first = served.act("prompt", &at(pixel, true))["selection"]["count"].as_u64().unwrap();
    let state = served.act("prompt", &at([3.0, 56.0], false));
    assert_eq!(state["selection"]["gestures"], 2);
    assert!(state["selection"]["count"].as_u64().unwrap() <= first, "{first}: {state}");
    // The point of the world that the pixel shows selects the same, by the view that sees it best.
    served.act("clear", &json!({}));
    let world = toy.capture.views[0].camera_from_world.inverse();
    let eye = world.transform_point(glam::DVec3::ZERO).to_array();
    let state = served.act(
        "prompt",
        &json!({ "kind": "click", "point": [0.1, 0.0, 0.6], "eye": eye, "positive": true }),
    );
    let by_point = state["selection"]["count"].as_u64().unwrap();
    assert!(by_point.abs_diff(first) * 20 <= first, "{by_point} {first}");
    let state = served.act("keep", &json!({ "name": "the box" }));
    assert_eq!(state["selections"], json!(["the box"]));
    assert_eq!(state["selection"]["name"], "the box");
    assert_eq!(state["steps"][0]["id"], "the box");
    let click = &state["steps"][0]["steps"][0]["clicks"][0];
    assert_eq!(click["view"], json!(view), "{click}");
    // The name may be given once, and a box and a stroke select, too.
    served.act("prompt", &json!({ "kind": "box", "view": view, "pixels": [10, 10, 70, 50] }));
    let again = served.post("keep", &json!({ "name": "the box" }));
    assert_eq!(again.code, 422);
    let stroke = json!({ "kind": "stroke", "view": view, "points": [pixel, [pixel[0] + 3.0, pixel[1]]], "positive": true });
    served.act("prompt", &stroke);
    served.act("choose", &json!({ "name": "the box" }));
    let state = served.act("act", &json!({ "op": { "op": "delete" } }));
    assert_eq!((&state["selection"], &state["selections"]), (&Value::Null, &json!([])));
    assert_eq!(served.post("act", &json!({ "op": { "op": "delete" } })).code, 422);
}

#[test]
fn what_is_undone_is_as_if_it_never_was_and_comes_back_the_same() {
    let toy = scene_with_photos();
    let served = Served::start(toy.folder.path(), &SCENE);
    let before = served.get("gaussians").body;
    served.act("light", &json!({ "sun": "noon" }));
    served.act("light", &json!({ "sun": "azimuth=10,elevation=20" }));
    // While the sun is dragged each place takes that of the one before.
    served.act("light", &json!({ "sun": "azimuth=20,elevation=20", "replace": true }));
    let state = served.act("light", &json!({ "rotate_deg": 30.0 }));
    let file = state["steps"][2]["file"].as_str().unwrap();
    assert!(Path::new(file).is_absolute() && file.ends_with("environment.exr"), "{file}");
    let suns: Vec<&Value> =
        state["steps"].as_array().unwrap().iter().map(|step| &step["sun"]).collect();
    assert_eq!(suns[..2], [&json!("noon"), &json!("azimuth=20,elevation=20")], "{state}");
    served.settled();
    let after = served.get("gaussians").body;
    assert!(after != before);
    for _ in 0..3 {
        served.act("undo", &json!({}));
    }
    served.settled();
    assert!(served.get("gaussians").body == before, "nothing is left");
    assert_eq!(served.post("undo", &json!({})).code, 422);
    for _ in 0..3 {
        served.act("redo", &json!({}));
    }
    assert_eq!(served.post("redo", &json!({})).code, 422);
    served.settled();
    assert!(served.get("gaussians").body == after, "all is back");
}

#[test]
fn a_splat_without_photos_is_selected_by_what_is_connected() {
    let toy = toy_scene();
    let splat = ["--gaussians", "scene/gaussians.ply"];
    let served = Served::start(toy.folder.path(), &splat);
    let click = json!({ "kind": "click", "point": [0.3, 0.0, 0.4], "eye": [2.6, 0.0, 2.4], "positive": true });
    let state = served.act("prompt", &click);
    let count = state["selection"]["count"].as_u64().unwrap();
    assert!((100..2000).contains(&count), "{state}");
    served.act("act", &json!({ "op": { "op": "transform", "scale": 1.5, "pivot": "base" } }));
    served.settled();
    std::fs::write(toy.path("saved.json"), served.get("plan").body).unwrap();
    let mut command = Command::new(program("edit"));
    command.args(splat).args(["--no-provenance", "-q", "--plan", "saved.json", "-o", "edited.ply"]);
    let output = command.current_dir(toy.folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(served.get("gaussians").body == std::fs::read(toy.path("edited.ply")).unwrap());
}
