//! The stage `segment-select` as a program, and `render` with what it writes.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::process::{Command, Output};

use glam::DVec3;
use motes_formats::exr_aov::open_exr;
use motes_formats::images::{read_image, write_png};
use motes_formats::ply::read_gaussians;
use motes_formats::selection::{
    BoundGaussians, SelectionDocument, SelectionNotes, write_selection,
};
use motes_raster::RenderOptions;
use motes_scene::{ColumnValues, ImageU8, Selection};
use motes_testkit::toy_scene::{ToyScene, toy_scene};
use serde_json::{Value, json};

fn run(toy: &ToyScene, program: &str, arguments: &[&str]) -> Output {
    Command::new(program)
        .args(arguments)
        .arg("--no-provenance")
        .env("XDG_CACHE_HOME", toy.path("caches"))
        .current_dir(toy.folder.path())
        .output()
        .unwrap()
}

fn select(toy: &ToyScene, arguments: &[&str]) -> Output {
    let all =
        [&["--scene", "scene", "--capture", "capture.json", "-o", "s.json"], arguments].concat();
    run(toy, env!("CARGO_BIN_EXE_segment-select"), &all)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A pixel on the middle of the box's top, as a click on a view.
fn click(toy: &ToyScene, view: usize) -> String {
    let view = &toy.capture.views[view];
    let camera = toy.capture.cameras[view.camera].as_pinhole().unwrap();
    let p = view.camera_from_world.transform_point(DVec3::new(0.0, 0.0, 0.6));
    let (x, y) = (camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy);
    let stem = view.name.rsplit_once('.').map_or(view.name.as_str(), |n| n.0);
    format!("{stem},{x},{y}")
}

#[test]
fn a_click_becomes_a_selection_overlays_labels_masks_and_mattes() {
    let toy = toy_scene();
    let click = click(&toy, 1);
    let arguments = [
        "--click",
        &click,
        "--overlay",
        "seen",
        "--cache",
        "kept",
        "-O",
        "labeled.ply",
        "--label",
        "7",
        "--candidates",
        "2",
    ];
    let done = select(&toy, &arguments);
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    let read = |name: &str| -> Value {
        serde_json::from_slice(&std::fs::read(toy.path(name)).unwrap()).unwrap()
    };
    let document = read("s.json");
    assert_eq!(document["format"], "motes/selection");
    // The box has 500 of 2804 Gaussians; its lowest rows may go either way.
    let count = document["count"].as_u64().unwrap();
    assert!((400..=560).contains(&count), "{count}");
    let top = document["object_box"]["max"][2].as_f64().unwrap();
    assert!((top - 0.6).abs() < 0.03, "{top}");
    assert!(document["support_plane"]["normal"][2].as_f64().unwrap() > 0.99);
    assert!(read("s.part.json")["count"].as_u64().unwrap() < count);
    assert!(std::fs::read_dir(toy.path("seen")).unwrap().count() >= 3);
    let labeled = read_gaussians(&toy.path("labeled.ply")).unwrap();
    let column = labeled.extra.iter().find(|c| c.name == "object_id").unwrap();
    let ColumnValues::U32(labels) = &column.values else { panic!("{column:?}") };
    assert_eq!(labels.iter().filter(|&&l| l == 7).count() as u64, count);

    // The same prompt again is answered from the cache, with the same bytes.
    let first = std::fs::read(toy.path("s.json")).unwrap();
    let again = select(&toy, &["--click", &click, "--cache", "kept", "-w"]);
    assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));
    assert_eq!(std::fs::read(toy.path("s.json")).unwrap(), first);

    // Where nothing is said, views are kept in the user's folder of caches, in one for this build.
    let kept = |folder: &str| -> usize {
        let builds = std::fs::read_dir(toy.path(folder)).into_iter().flatten().flatten();
        builds.map(|build| std::fs::read_dir(build.path()).unwrap().count()).sum()
    };
    let unsaid = select(&toy, &["--click", &click, "-w", "--no-cache"]);
    assert_eq!((unsaid.status.code(), kept("caches/motes/views")), (Some(0), 0));
    let usual = select(&toy, &["--click", &click, "-w"]);
    assert_eq!(usual.status.code(), Some(0), "{}", stderr(&usual));
    assert_eq!(kept("caches/motes/views"), std::fs::read_dir(toy.path("kept")).unwrap().count());
    assert_eq!(std::fs::read(toy.path("s.json")).unwrap(), first);

    let render = |arguments: &[&str]| {
        let view = toy.capture.views[1].name.clone();
        let all = [&["--capture", "capture.json", "--view", &view], arguments].concat();
        run(&toy, motes_testkit::program("render"), &all)
    };
    let plain = ["--gaussians", "scene/gaussians.ply"];
    let mask = render(&[&plain[..], &["--selection", "s.json", "--mask", "-o", "masks"]].concat());
    assert_eq!(mask.status.code(), Some(0), "{}", stderr(&mask));
    let name = std::fs::read_dir(toy.path("masks")).unwrap().next().unwrap().unwrap().path();
    let mask = read_image(&name).unwrap();
    let white = mask.data.iter().step_by(mask.channels).filter(|&&v| v > 200).count();
    assert!(white > 50 && white < mask.pixel_count() / 2, "{white}");

    let flags =
        ["--gaussians", "labeled.ply", "--object-ids", "object_id", "--format", "exr", "-o", "exr"];
    let exr = render(&flags);
    assert_eq!(exr.status.code(), Some(0), "{}", stderr(&exr));
    let name = std::fs::read_dir(toy.path("exr")).unwrap().next().unwrap().unwrap().path();
    let image = open_exr(&name).unwrap();
    let manifest = image.attributes.iter().find(|a| a.0.ends_with("/manifest")).unwrap().1;
    let manifest: Value = serde_json::from_str(manifest).unwrap();
    let id = u32::from_str_radix(manifest["object_id_7"].as_str().unwrap(), 16).unwrap();
    let ids = image.channel("CryptoObject00.R").unwrap().to_f32();
    let coverage = image.channel("CryptoObject00.G").unwrap().to_f32();
    let covered = ids.iter().zip(&coverage).filter(|(i, c)| i.to_bits() == id && **c > 0.8).count();
    assert!(covered.abs_diff(white) <= white / 10, "{covered} {white}");

    // The labeled file is another file: the selection of the first does not belong to it.
    let line = ["--gaussians", "labeled.ply", "--selection", "s.json", "--mask", "-o", "stale"];
    let stale = render(&line);
    assert_eq!(stale.status.code(), Some(3));
    assert!(stderr(&stale).contains("stale"), "{}", stderr(&stale));
}

#[test]
fn a_selection_of_what_was_decomposed_holds_for_the_scene() {
    let toy = toy_scene();
    let path = toy.path("scene/decomposition.json");
    let mut document: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let count = document["counts"]["gaussians"].as_u64().unwrap();
    let source = json!({ "sha256": "1".repeat(64), "count": count, "name": "trained.ply" });
    let bound: BoundGaussians = serde_json::from_value(source.clone()).unwrap();
    let some = Selection::where_true(count as usize, |i| i % 3 == 0);
    let selection = SelectionDocument::new(&some, bound, SelectionNotes::default());
    write_selection(&toy.path("trained.json"), &selection).unwrap();
    let prompt = ["--select", "file=trained.json", "-w"];
    let drawn = |out: &str| {
        let name = toy.capture.views[1].name.clone();
        let line = ["--capture", "capture.json", "--view", &name, "--scene", "scene", "--mask"];
        let line = [&line[..], &["--selection", "trained.json", "-o", out]].concat();
        run(&toy, motes_testkit::program("render"), &line)
    };
    for done in [select(&toy, &prompt), drawn("stale")] {
        assert_eq!(done.status.code(), Some(3), "{}", stderr(&done));
        assert!(stderr(&done).contains("stale"), "{}", stderr(&done));
    }
    document["source_gaussians"] = source;
    std::fs::write(&path, serde_json::to_vec(&document).unwrap()).unwrap();
    for done in [select(&toy, &prompt), drawn("masks")] {
        assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    }
    assert_eq!(std::fs::read_dir(toy.path("masks")).unwrap().count(), 1);
    // What is written belongs to the Gaussians of the scene.
    let written: Value =
        serde_json::from_slice(&std::fs::read(toy.path("s.json")).unwrap()).unwrap();
    assert_eq!(written["gaussians"]["name"], "gaussians.ply");
    assert_eq!(written["count"], count.div_ceil(3));
}

#[test]
fn bad_prompts_are_refused_and_leave_nothing() {
    let toy = toy_scene();
    let name = toy.capture.views[0].name.clone();
    for (arguments, code, part) in [
        (vec!["--click".to_owned(), "nowhere,3,3".into()], 3, "no view named \"nowhere\""),
        (vec!["--click".into(), format!("{name},3,100000")], 3, "outside view"),
        (vec!["--click".into(), format!("{name},3,3,-")], 3, "does not say what to select"),
        (vec!["--click".into(), "v,1".into()], 2, "VIEW,X,Y"),
        (vec!["--select".into(), "property=z,gt,1e9".into()], 3, "nothing is selected"),
        (vec!["--select".into(), "sphere=0,0,0".into()], 2, "RADIUS"),
        (vec!["--select".into(), "property=zz,gt,1".into()], 3, "no property \"zz\""),
        (vec!["--mask".into(), format!("{name}=none.png")], 3, "none.png"),
        (
            vec!["--candidates".into(), "3".into(), "--select".into(), "all".into()],
            2,
            "--candidates",
        ),
        (vec![], 2, "nothing was asked for"),
    ] {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let done = select(&toy, &arguments);
        assert_eq!(done.status.code(), Some(code), "{arguments:?}: {}", stderr(&done));
        assert!(stderr(&done).contains(part), "{arguments:?}: {}", stderr(&done));
        assert!(!toy.path("s.json").exists(), "{arguments:?}");
    }
}

/// Photos of the views: the box red, the rest blue.
fn take_photos(toy: &ToyScene) {
    let gaussians = read_gaussians(&toy.path("scene/gaussians.ply")).unwrap();
    let is_box = Selection::where_true(gaussians.len(), |i| gaussians.means[i][2] > 0.01);
    for view in &toy.capture.views {
        let camera = toy.capture.cameras[view.camera].as_pinhole().unwrap();
        let (pose, options) = (&view.camera_from_world, RenderOptions::default());
        let mask = segment_select::selection_mask(&gaussians, &is_box, &camera, pose, &options);
        let color = |m: &f32| if *m > 0.5 { [230, 40, 30] } else { [20, 60, 160] };
        let pixels = mask.data.iter().flat_map(color).collect();
        let photo = ImageU8::from_data(camera.width, camera.height, 3, pixels);
        write_png(&toy.path(&view.image.to_string_lossy()), &photo).unwrap();
    }
}

fn data(name: &str) -> String {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../testdata")
        .join(name)
        .display()
        .to_string()
}

#[cfg(unix)]
#[test]
fn sam_answers_a_click_and_its_answers_are_kept() {
    let toy = toy_scene();
    take_photos(&toy);
    motes_testkit::program("motes-provider-sam");
    let click = click(&toy, 1);
    for export in ["meta", "sam2-js"] {
        let model = data(&format!("sam/{export}"));
        let line = ["--click", &click, "--segmenter", "sam", "--model", &model, "--json", "-w"];
        let ask = || {
            let done = select(&toy, &line);
            assert_eq!(done.status.code(), Some(0), "{export}: {}", stderr(&done));
            let report: Value = serde_json::from_slice(&done.stdout).unwrap();
            (report, std::fs::read(toy.path("s.json")).unwrap())
        };
        let (report, first) = ask();
        let count = report["count"].as_u64().unwrap();
        assert!((400..=560).contains(&count), "{export}: {count}");
        let top = report["object_box"]["max"][2].as_f64().unwrap();
        assert!((top - 0.6).abs() < 0.03, "{export}: {top}");
        let by = &report["segmenter"];
        assert_eq!(by["provider"]["name"], "sam");
        assert_eq!(by["provider"]["models"][1]["id"], "prompt_encoder_mask_decoder.onnx");
        let asked = by["views_asked"].as_array().unwrap().len() as u64;
        assert!(asked > 1 && by["provider"]["answered"] == asked, "{by}");
        let (report, again) = ask();
        let by = &report["segmenter"]["provider"];
        assert_eq!((by["kept"].as_u64(), by["answered"].as_u64()), (Some(asked), Some(0)));
        assert_eq!(again, first, "{export}");
    }
}

#[test]
fn a_segmenter_that_cannot_answer_is_told_and_no_file_starts_one() {
    let toy = toy_scene();
    let name = toy.capture.views[0].name.clone();
    let click = format!("{name},40,30");
    let model = data("sam/meta");
    std::fs::write(toy.path("sam.json"), json!({"segmenter": "sam", "model": &model}).to_string())
        .unwrap();
    let command = format!("touch {}", toy.path("started").display());
    let provider = json!({"segmenter": "provider", "provider": &command});
    std::fs::write(toy.path("provider.json"), provider.to_string()).unwrap();
    let copy = format!("python3 '{}'", data("providers/copy.py"));
    for (line, code, says) in [
        (vec!["--segmenter", "sam"], 2, "needs weights"),
        (vec!["--model", &model], 2, "--model is for --segmenter sam"),
        (vec!["--provider", "sam"], 2, "--provider is for --segmenter provider"),
        (vec!["--segmenter", "provider"], 2, "needs a program"),
        (vec!["--segmenter", "sam", "--model", "nowhere"], 3, "no such file or folder: nowhere"),
        (vec!["--segmenter", "sam", "--model", "scene"], 3, "no .onnx file with \"encoder\""),
        (
            vec!["--segmenter", "provider", "--provider", "no-such-one"],
            3,
            "no provider no-such-one",
        ),
        (vec!["--segmenter", "provider", "--provider", &copy], 3, "does not do segment"),
        (vec!["--segmenter", "provider", "--config", "provider.json"], 2, "may not name a program"),
        (vec!["--config", "provider.json"], 2, "may not choose a segmenter"),
        (vec!["--config", "sam.json"], 2, "may not choose a segmenter"),
    ] {
        let done = select(&toy, &[&["--click", &click], &line[..]].concat());
        assert_eq!(done.status.code(), Some(code), "{line:?}: {}", stderr(&done));
        assert!(stderr(&done).contains(says), "{line:?}: {}", stderr(&done));
        assert!(!toy.path("s.json").exists() && !toy.path("started").exists(), "{line:?}");
    }
}
