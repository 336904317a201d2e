//! The stage `edit` as a program: plans, flags, replay, dry runs, and what a failure leaves alone.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

mod plans;
mod providers;
mod streams;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

use edit::files::read_edit_plan;
use motes_codecs::{SplatFormat, SplatWriteOptions, open_gaussians, write_gaussians};
use motes_formats::decomposition::read_decomposition;
use motes_formats::images::read_image;
use motes_formats::ply::{read_gaussians, read_surface};
use motes_formats::selection::{
    BoundGaussians, SelectionDocument, SelectionNotes, write_selection,
};
use motes_math::tone_curve::ToneCurve;
use motes_scene::Selection;
use motes_testkit::toy_scene::{ToyScene, toy_scene};
use serde_json::{Value, json};

/// The box of the toy scene, without the floor.
const BOX_STEP: &str = "box=-0.35,-0.35,0.01,0.35,0.35,0.7";

fn edit(toy: &ToyScene, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_edit"))
        .args(arguments)
        .current_dir(toy.folder.path())
        .output()
        .unwrap()
}

fn text(done: &Output) -> String {
    String::from_utf8_lossy(&done.stderr).into_owned()
}

#[track_caller]
fn assert_code(done: &Output, code: i32) {
    assert_eq!(done.status.code(), Some(code), "{}", text(done));
}

#[track_caller]
fn answer(done: &Output) -> Value {
    assert_code(done, 0);
    serde_json::from_slice(&done.stdout).unwrap()
}

fn put_plan(toy: &ToyScene, name: &str, ops: &Value) {
    let plan = json!({ "format": "motes/edit-plan", "version": "1.0", "seed": 3, "ops": ops });
    std::fs::write(toy.path(name), plan.to_string()).unwrap();
}

/// Name and bytes of every file below a folder.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in std::fs::read_dir(at).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().display().to_string();
                found.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    found
}

const SCENE: [&str; 3] = ["--scene", "scene", "--no-provenance"];
const QUICK: [&str; 2] = ["--reshade-samples", "4"];

#[test]
fn a_log_replays_to_the_same_bytes() {
    let toy = toy_scene();
    let ops = json!([
        { "op": "select", "id": "box", "steps": [{ "by": "box", "center": [0.0, 0.0, 0.36], "half_size": [0.35, 0.35, 0.35] }] },
        { "op": "transform", "translate": [0.9, 0.2, 0.0], "rotate_axis": { "axis": [0, 0, 1], "deg": 20 }, "fill": "plane" },
        { "op": "duplicate", "target": "box", "translate": [-1.6, -0.9, 0.0], "as": "twin" },
        { "op": "recolor", "target": "twin", "rgb_linear": [0.6, 0.1, 0.1] },
        { "op": "remove_floaters" }, { "op": "undo" },
        { "op": "measure", "target": "twin" },
    ]);
    put_plan(&toy, "plan.json", &ops);
    let line =
        [&SCENE[..], &QUICK, &["--plan", "plan.json", "-o", "first", "--json", "-q"]].concat();
    let said = answer(&edit(&toy, &line));
    assert_eq!(said["applied"].as_array().unwrap().len(), 5, "{said}");
    assert_eq!(said["skipped"][0]["at"], "/ops/4", "{said}");
    assert!(said["applied"][4]["numbers"]["height"].as_f64().unwrap() > 0.4, "{said}");
    // The number of directions is in the log.
    let line = [&SCENE[..], &["--plan", "first/edit-log.json", "-o", "second", "-q", "-j", "1"]];
    assert_code(&edit(&toy, &line.concat()), 0);
    let (first, second) = (files(&toy.path("first")), files(&toy.path("second")));
    let names: Vec<&String> = first.keys().collect();
    assert_eq!(names.len(), 5, "{names:?}");
    for (name, bytes) in &first {
        assert!(second.get(name) == Some(bytes), "{name} differs");
    }
    // What was written is a scene folder: it can be edited again.
    let document = read_decomposition(&toy.path("first")).unwrap().document;
    let gaussians = read_gaussians(&toy.path("first/gaussians.ply")).unwrap();
    assert_eq!(document.counts.gaussians, gaussians.len() as u64);
    let line = ["--scene", "first", "--no-provenance", "--order", "-o", "third", "-q"];
    assert_code(&edit(&toy, &line), 0);
}

#[test]
fn a_selection_of_what_was_decomposed_holds_for_the_scene_until_rows_change() {
    let toy = toy_scene();
    let path = toy.path("scene/decomposition.json");
    let mut document: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let count = document["counts"]["gaussians"].as_u64().unwrap();
    let source = json!({ "sha256": "1".repeat(64), "count": count, "name": "trained.ply" });
    let bound: BoundGaussians = serde_json::from_value(source.clone()).unwrap();
    let all = Selection::all(count as usize);
    let selection = SelectionDocument::new(&all, bound, SelectionNotes::default());
    write_selection(&toy.path("all.json"), &selection).unwrap();
    let line = ["--scene", "scene", "--selection", "all.json", "--translate", "0,0,1", "-q", "-o"];
    assert_code(&edit(&toy, &[&line[..], &["stale"]].concat()), 3);
    document["source_gaussians"] = source;
    std::fs::write(&path, serde_json::to_vec(&document).unwrap()).unwrap();
    assert_code(&edit(&toy, &[&line[..], &["out"]].concat()), 0);
    let again = ["--scene", "out", "--selection", "all.json", "--translate", "0,0,1", "-q"];
    assert_code(&edit(&toy, &[&again[..], &["-o", "again"]].concat()), 3);
}

#[test]
fn pictures_have_the_tone_curve_that_the_scene_names() {
    let toy = toy_scene();
    let shown = |name: &str| {
        let (shots, out) = (format!("{name}-shots"), format!("{name}-out"));
        let line = ["--scene", "scene", "--order", "--thumbnails", &shots, "-o", &out, "-q"];
        assert_code(&edit(&toy, &line), 0);
        read_image(&toy.path(&shots).join("before.png")).unwrap().data
    };
    let plain = shown("plain");
    let path = toy.path("scene/decomposition.json");
    let mut document: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    document["tone_curve_contrast"] = json!(0.5);
    std::fs::write(&path, serde_json::to_vec(&document).unwrap()).unwrap();
    let curve = ToneCurve::new(0.5);
    let curved = shown("curved");
    let off =
        |(a, b): (&u8, &u8)| (255.0 * curve.apply(f32::from(*a) / 255.0) - f32::from(*b)).abs();
    assert!(plain != curved && plain.iter().zip(&curved).all(|pair| off(pair) < 1.2));
    let written = read_decomposition(&toy.path("curved-out")).unwrap().document;
    assert_eq!(written.tone_curve_contrast, Some(0.5));
}

#[test]
fn a_dry_run_answers_and_writes_nothing() {
    let toy = toy_scene();
    let before = files(toy.folder.path());
    let line = [
        &SCENE[..],
        &QUICK,
        &[
            "--select",
            BOX_STEP,
            "--delete",
            "--thumbnails",
            "shots",
            "-o",
            "out",
            "--dry-run",
            "--json",
        ],
    ]
    .concat();
    let said = answer(&edit(&toy, &line));
    assert_eq!(said["dry_run"], true);
    let (was, is) = (&said["report"]["gaussians_before"], &said["report"]["gaussians"]);
    assert!(was.as_u64() > is.as_u64(), "{said}");
    assert_eq!(said["report"]["applied"][1]["op"], "delete");
    assert!(files(toy.folder.path()) == before, "files appeared");
}

#[test]
fn flags_are_applied_in_their_order() {
    let toy = toy_scene();
    let base = ["--gaussians", "scene/gaussians.ply", "--no-provenance", "-q", "--pivot", "origin"];
    let mean = |name: &str, flags: &[&str]| {
        assert_code(&edit(&toy, &[&base[..], flags, &["-o", name]].concat()), 0);
        read_gaussians(&toy.path(name)).unwrap().means[7]
    };
    let at = mean("a.ply", &["--translate", "1,0,0", "--measure"]);
    let scaled_last = mean("b.ply", &["--translate", "1,0,0", "--scale", "2"]);
    let scaled_first = mean("c.ply", &["--scale", "2", "--translate", "1,0,0"]);
    assert!((scaled_last[0] - 2.0 * at[0]).abs() < 1e-5, "{scaled_last:?} {at:?}");
    assert!(
        (scaled_last[0] - scaled_first[0] - 1.0).abs() < 1e-5,
        "{scaled_last:?} {scaled_first:?}"
    );
    let plan = read_edit_plan(&toy.path("b.ply.edit-log.json")).unwrap().document;
    assert_eq!(plan.ops.iter().map(|op| op.name()).collect::<Vec<_>>(), ["transform"; 2]);
}

#[test]
fn a_copy_that_moves_on_leaves_no_hole() {
    let toy = toy_scene();
    let line = [
        &SCENE[..],
        &QUICK,
        &["--select", BOX_STEP, "--duplicate", "0.9,0,0", "--rotate-axis", "0,0,1,30"],
        &["-o", "copied", "--json"],
    ];
    let answer = answer(&edit(&toy, &line.concat()));
    assert_eq!(answer["skipped"], json!([]));
    assert_eq!(answer["light"]["filled"], 0);
}

#[test]
fn meshes_and_splats_are_inserted_and_swapped() {
    let toy = toy_scene();
    let pyramid = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        element face 5\nproperty list uchar int vertex_indices\nend_header\n\
        -1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n0 0 3\n4 3 2 1 0\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";
    std::fs::write(toy.path("pyramid.ply"), pyramid).unwrap();
    let line = [
        &SCENE[..],
        &QUICK,
        &[
            "--select",
            BOX_STEP,
            "--fill",
            "plane",
            "--swap",
            "{\"file\":\"pyramid.ply\",\"material\":\"gold\",\"gaussians\":3000,\"as\":\"p\"}",
        ],
        &["--measure", "--thumbnails", "shots", "-o", "out", "--json", "-q"],
    ]
    .concat();
    let said = answer(&edit(&toy, &line));
    let numbers = &said["applied"][2]["numbers"];
    // As tall as the box was above the plane of the selection, standing where it stood.
    assert!((numbers["height"].as_f64().unwrap() - 0.57).abs() < 0.04, "{numbers}");
    assert!(numbers["base_z"].as_f64().unwrap().abs() < 0.06, "{numbers}");
    assert!(said["light"]["shaded"].as_u64().unwrap() >= 3000, "{said}");
    let surface = read_surface(&toy.path("out/surface.ply")).unwrap();
    assert!(surface.metallic.contains(&1.0), "its surface came along");
    for picture in ["before.png", "after.png"] {
        assert_eq!(read_image(&toy.path("shots").join(picture)).unwrap().width, 480);
    }
    assert_ne!(
        read_image(&toy.path("shots/before.png")).unwrap(),
        read_image(&toy.path("shots/after.png")).unwrap()
    );
}

#[test]
fn what_is_inserted_in_other_units_is_told() {
    let toy = toy_scene();
    let gaussians = read_gaussians(&toy.path("scene/gaussians.ply")).unwrap();
    let written = gaussians.len();
    let inserted = |factor: &str| {
        let scale = ["--scale", factor, "-o", "other.ply", "-w"];
        assert_code(
            &edit(&toy, &[&["--gaussians", "scene/gaussians.ply"], &scale[..]].concat()),
            0,
        );
        let line =
            ["--gaussians", "scene/gaussians.ply", "--insert", "other.ply", "-o", "both.ply"];
        let keep = ["--surroundings", "keep", "-w", "--json", "-q"];
        let said = answer(&edit(&toy, &[&line[..], &keep].concat()));
        assert_eq!(said["gaussians"], 2 * written);
        said["warnings"].to_string()
    };
    assert!(inserted("0.001").contains("times the size of the scene"));
    assert!(!inserted("0.5").contains("times the size of the scene"));
}

#[test]
fn splats_of_other_codecs_are_edited_inserted_and_written() {
    let toy = toy_scene();
    let gaussians = read_gaussians(&toy.path("scene/gaussians.ply")).unwrap();
    let n = gaussians.len() as u64;
    for format in SplatFormat::ALL {
        let codec = format.codec();
        if !(codec.is_readable() && codec.is_writable()) {
            continue;
        }
        let name = format!("asset.{}", codec.suffixes[0].trim_start_matches('.'));
        let options = SplatWriteOptions::default();
        write_gaussians(&toy.path(&name), *format, &gaussians, &options).unwrap();
        let insert = ["--gaussians", name.as_str(), "--insert", name.as_str(), "-o", "out.ply"];
        let keep = ["--surroundings", "keep", "--no-provenance", "--json", "-q", "--overwrite"];
        let said = answer(&edit(&toy, &[&insert[..], &keep].concat()));
        assert_eq!(said["gaussians"].as_u64(), Some(2 * n), "{name}: {said}");
        let edited = format!("edited-{name}");
        // The file comes first, without its flag.
        let line = ["scene/gaussians.ply", "--order", "-o", &edited, "--json", "-q"];
        answer(&edit(&toy, &line));
        assert_eq!(open_gaussians(&toy.path(&edited)).unwrap().gaussians.len() as u64, n, "{name}");
    }
    let line = ["--gaussians", "scene/gaussians.ply", "--order", "-o", "out.txt"];
    let done = edit(&toy, &line);
    assert_code(&done, 2);
    assert!(text(&done).contains("names no format of Gaussians"), "{}", text(&done));
    assert!(!toy.path("out.txt").exists());
}

#[test]
fn a_plain_splat_warns_where_light_would_follow() {
    let toy = toy_scene();
    let line = [
        "--gaussians",
        "scene/gaussians.ply",
        "--select",
        BOX_STEP,
        "--translate",
        "1,0,0",
        "--set-environment",
        "scene/environment.exr",
        "-o",
        "moved.ply",
        "--no-provenance",
        "--json",
    ];
    let done = edit(&toy, &line);
    let said = answer(&done);
    let warned = text(&done);
    assert!(
        warned.contains("shadows stay where they were") && warned.contains("(/ops/1)"),
        "{warned}"
    );
    assert_eq!(said["skipped"][0]["op"], "set_environment");
    assert_eq!(said["light"], Value::Null);
    // The fallback is part of the plan, so that the log has it.
    let line = [
        "--gaussians",
        "scene/gaussians.ply",
        "--select",
        BOX_STEP,
        "--translate",
        "1,0,0",
        "--shadow",
        "ratio",
        "-o",
        "ratio.ply",
        "--no-provenance",
    ];
    let done = edit(&toy, &line);
    assert_code(&done, 0);
    assert!(!text(&done).contains("shadows stay"), "{}", text(&done));
    let log = std::fs::read_to_string(toy.path("ratio.ply.edit-log.json")).unwrap();
    assert!(log.contains("\"shadow\": \"ratio\""), "{log}");
}
