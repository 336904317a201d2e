//! The stage `instruct` as a program: plans that `edit` runs, alternatives, what is refused.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

mod providers;
mod refusals;

use std::path::Path;
use std::process::{Command, Output};

use edit::files::read_edit_plan;
use motes_formats::documents::read_document;
use motes_formats::ply::read_gaussians;
use motes_formats::scene_card::SceneCardDocument;
use motes_formats::selection::{
    BoundGaussians, SelectionDocument, SelectionNotes, write_selection,
};
use motes_scene::Selection;
use motes_testkit::toy_scene::{ToyScene, toy_scene};
use serde_json::{Value, json};

fn instruct(toy: &ToyScene, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_instruct"))
        .args(arguments)
        .current_dir(toy.folder.path())
        .output()
        .unwrap()
}

fn said(done: &Output) -> String {
    String::from_utf8_lossy(&done.stderr).into_owned()
}

#[track_caller]
fn report(done: &Output) -> Value {
    assert_eq!(done.status.code(), Some(0), "{}", said(done));
    serde_json::from_slice(&done.stdout).unwrap()
}

/// The toy scene with its box labeled.
fn labeled() -> ToyScene {
    let toy = toy_scene();
    let file = toy.path("scene/gaussians.ply");
    let gaussians = read_gaussians(&file).unwrap();
    let bound = BoundGaussians::of_file(&file, gaussians.len()).unwrap();
    let is_box = |i: usize| {
        let [x, y, z] = gaussians.means[i];
        z > 0.01 && x.abs() < 0.4 && y.abs() < 0.4
    };
    let selection = Selection::where_true(gaussians.len(), is_box);
    std::fs::create_dir(toy.path("labels")).unwrap();
    let document = SelectionDocument::new(&selection, bound, SelectionNotes::default());
    write_selection(&toy.path("labels/box.json"), &document).unwrap();
    put_labels(
        &toy,
        &json!([{ "name": "box", "selection": "box.json", "also": ["crate", "chair"] }]),
    );
    toy
}

fn put_labels(toy: &ToyScene, objects: &Value) {
    let document = json!({ "format": "motes/labels", "version": "1.0", "objects": objects });
    std::fs::write(toy.path("labels/labels.json"), document.to_string()).unwrap();
}

const TEXTBOOK: &str = "relight this scene as a sunset and move the chair to the right";
const SCENE: [&str; 5] = ["--scene", "scene", "--labels", "labels/labels.json", "--no-provenance"];

#[test]
fn the_textbook_sentence_is_a_plan_that_edit_would_run_and_apply_runs_it() {
    let toy = labeled();
    let line = [&[TEXTBOOK], &SCENE[..], &["-o", "plans/plan.json", "--explain"]].concat();
    std::fs::create_dir(toy.path("plans")).unwrap();
    let done = instruct(&toy, &line);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    assert!(said(&done).contains("to the right"), "{}", said(&done));
    let plan = read_edit_plan(&toy.path("plans/plan.json")).unwrap().document;
    let names: Vec<&str> = plan.ops.iter().map(edit::ops::OpDocument::name).collect();
    assert_eq!(names, ["select", "transform", "set_environment"]);
    let select = serde_json::to_value(&plan.ops[0]).unwrap();
    assert_eq!(select["steps"][0]["path"], "../labels/box.json");

    let line = [&[TEXTBOOK], &SCENE[..], &["--apply", "-o", "edited", "--json", "-q"]].concat();
    let answer = report(&instruct(&toy, &line));
    assert_eq!(answer["plans"][0]["edited"]["applied"].as_array().unwrap().len(), 3);
    let before = read_gaussians(&toy.path("scene/gaussians.ply")).unwrap();
    let after = read_gaussians(&toy.path("edited/gaussians.ply")).unwrap();
    let is_box = |m: &&[f32; 3]| m[2] > 0.05;
    let middle = |means: &[[f32; 3]]| {
        let xs: Vec<f32> = means.iter().filter(is_box).map(|m| m[0]).collect();
        xs.iter().sum::<f32>() / xs.len() as f32
    };
    let moved = middle(&after.means) - middle(&before.means);
    assert!(moved > 0.3, "{moved}");
}

#[test]
fn several_lights_are_alternatives() {
    let toy = labeled();
    let sentence = "matte black box under sunrise, midday and evening";
    let line = [&[sentence], &SCENE[..], &["-o", "plan.json", "--json", "-q"]].concat();
    let answer = report(&instruct(&toy, &line));
    assert_eq!(answer["plans"].as_array().unwrap().len(), 3);
    for light in ["sunrise", "midday", "evening"] {
        let plan = read_edit_plan(&toy.path(&format!("plan-{light}.json"))).unwrap().document;
        assert_eq!(plan.ops.len(), 3, "{light}");
    }
    let line = [&["box in gold at noon and sunset"], &SCENE[..], &["--apply", "-o", "lit", "-q"]];
    let done = instruct(&toy, &line.concat());
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    assert!(toy.path("lit/noon/environment.exr").exists());
    assert!(toy.path("lit/sunset/edit-log.json").exists());
}

#[test]
fn the_card_says_what_is_there_and_the_same_card_is_made_by_any_number_of_threads() {
    let toy = labeled();
    let card = |threads: &str| {
        let name = format!("card-{threads}.json");
        let line = [&SCENE[..], &["--card", &name, "--threads", threads]].concat();
        let done = instruct(&toy, &line);
        assert_eq!(done.status.code(), Some(0), "{}", said(&done));
        std::fs::read(toy.path(&name)).unwrap()
    };
    assert_eq!(card("1"), card("2"));
    let card: SceneCardDocument = read_document(&toy.path("card-1.json")).unwrap().document;
    let object = &card.objects[0];
    assert_eq!((object.id.as_str(), object.color.name.as_str()), ("box", "blue"));
    assert!((object.size.width - 0.6).abs() < 0.1, "{object:?}");
    assert!(object.height_above_ground.unwrap().abs() < 0.1, "{object:?}");
    assert!(card.decomposed && card.light.is_some());
}

#[test]
fn a_plain_splat_has_its_colors_changed_and_its_light_refused() {
    let toy = labeled();
    let splat = ["--gaussians", "scene/gaussians.ply", "--labels", "labels/labels.json"];
    let line = [&["remove the box and its shadow"], &splat[..], &["-o", "plan.json"]].concat();
    let done = instruct(&toy, &line);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let plan: Value =
        serde_json::from_slice(&std::fs::read(toy.path("plan.json")).unwrap()).unwrap();
    assert_eq!(plan["shadow"], "ratio");
    let line = [&["make it a sunset"], &splat[..], &["-o", "other.json"]].concat();
    let done = instruct(&toy, &line);
    assert_eq!(done.status.code(), Some(3));
    assert!(said(&done).contains("plain splat"), "{}", said(&done));
    assert!(!Path::new(&toy.path("other.json")).exists());
}
