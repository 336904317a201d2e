//! Clicks that a learned segmenter answers: SAM in ONNX files, in a program of its own.

use serde_json::json;

use super::acts::{edit, on_the_box};
use super::*;

/// Photos in which the box is red before blue: what the graphs of the fixtures take for an object.
fn take_photos(toy: &ToyScene) {
    let mut gaussians = read_gaussians(&toy.path("scene/gaussians.ply")).unwrap().with_sh_degree(0);
    for i in 0..gaussians.len() {
        let side = if gaussians.means[i][2] > 0.01 { 1.7 } else { -1.7 };
        gaussians.sh[3 * i..3 * i + 3].copy_from_slice(&[side, -1.7, -side]);
    }
    let camera = toy.capture.cameras[0].as_pinhole().unwrap();
    for view in &toy.capture.views {
        let options = RenderOptions::default();
        let mut photo = render(&gaussians, &camera, &view.camera_from_world, &options).color;
        for pixel in photo.data.chunks_exact_mut(3) {
            let is_box = pixel[0] > 0.5;
            pixel.copy_from_slice(if is_box { &[0.9, 0.16, 0.12] } else { &[0.08, 0.24, 0.63] });
        }
        write_png(&toy.path("").join(&view.image), &photo.to_u8()).unwrap();
    }
}

#[cfg(unix)]
#[test]
fn sam_answers_clicks_of_the_page_and_the_plan_needs_no_sam() {
    let toy = scene_with_photos();
    take_photos(&toy);
    motes_testkit::program("motes-provider-sam");
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/sam/sam2-js");
    let model = model.to_str().unwrap();
    let line = ["--scene", "scene", "--capture", "capture.json", "--segmenter", "sam"];
    let kept = toy.path("answers");
    let rest = ["--model", model, "--provider-cache", kept.to_str().unwrap()];
    let served = Served::start(toy.folder.path(), &[&line[..], &rest].concat());
    served.wait("ready", |state| state["views"] == "ready");
    let (view, pixel) = on_the_box(&toy);
    let at = |pixel: [f64; 2], positive: bool| json!({ "kind": "click", "view": view, "pixel": pixel, "positive": positive });
    let state = served.act("prompt", &at(pixel, true));
    let count = state["selection"]["count"].as_u64().unwrap();
    assert!((200..=560).contains(&count), "{count}");
    // The same click on the command line selects as many.
    let click = format!("{view},{},{}", pixel[0], pixel[1]);
    let mut command = Command::new(motes_testkit::program("segment-select"));
    command.args(line).args(["--model", model, "--provider-cache", "none", "--no-cache"]);
    command
        .args(["--click", &click, "-o", "s.json", "--json", "-q"])
        .current_dir(toy.folder.path());
    let typed: Value = serde_json::from_slice(&command.output().unwrap().stdout).unwrap();
    assert_eq!(typed["count"], count);
    let top = state["selection"]["max"][2].as_f64().unwrap();
    assert!((top - 0.6).abs() < 0.05, "{state}");
    println!("SAM of the fixtures answers a click after {} s", state["selection"]["seconds"]);
    // A click beside it is asked about, too.
    let state = served.act("prompt", &at([3.0, 56.0], false));
    assert_eq!(state["selection"]["gestures"], 2);
    assert!(std::fs::read_dir(&kept).unwrap().count() > 0, "nobody was asked");
    served.act("act", &json!({ "op": { "op": "set_material", "name": "brass" } }));
    let state = served.settled();
    // The plan says what was found by rows.
    let selector = &state["steps"][0]["steps"][0];
    assert!(selector["ids"].as_array().unwrap().len() > 300, "{selector}");
    std::fs::write(toy.path("saved.json"), served.get("plan").body).unwrap();
    edit(&toy, &["--plan", "saved.json", "-o", "replayed"]);
    let written = std::fs::read(toy.path("replayed/gaussians.ply")).unwrap();
    assert!(served.get("gaussians").body == written);
}
