//! The page of a relit scene, from pictures that `relight` made.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::process::{Command, Output};

use motes_formats::capture::{read_capture, write_capture};
use motes_formats::decomposition::{TermDocument, read_decomposition, write_decomposition};
use motes_formats::images::{read_image, write_png};
use motes_scene::Split;
use motes_testkit::toy_scene::{ToyScene, toy_scene};

fn run(toy: &ToyScene, program: &str, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).current_dir(toy.folder.path()).output().unwrap()
}

const REPORT: [&str; 10] = [
    "relight",
    "--scene",
    "scene",
    "--capture",
    "capture.json",
    "--own",
    "own",
    "--light",
    "dusk=dusk",
    "-o",
];

/// A toy scene with photos of its two first views, and its pictures in two lights.
fn relit() -> ToyScene {
    let toy = toy_scene();
    let path = toy.path("capture.json");
    let mut capture = read_capture(&path).unwrap();
    capture.views.truncate(2);
    for (i, view) in capture.views.iter_mut().enumerate() {
        view.split = Split::Test;
        view.image = format!("photos/{i}.png").into();
    }
    write_capture(&path, &capture).unwrap();
    let relight = |arguments: &[&str]| {
        let common = ["--scene", "scene", "--capture", "capture.json", "--split", "test", "-q"];
        let done = run(&toy, motes_testkit::program("relight"), &[&common, arguments].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    };
    relight(&["--format", "both", "-o", "own"]);
    relight(&["--sun", "azimuth=40,elevation=10", "--sky", "-o", "dusk"]);
    std::fs::create_dir_all(toy.path("photos")).unwrap();
    let stems = ["view_0", "view_1"];
    for (i, stem) in stems.iter().enumerate() {
        let mut photo = read_image(&toy.path(&format!("own/{stem}.png"))).unwrap();
        photo.data.iter_mut().for_each(|v| *v = v.saturating_add(4));
        write_png(&toy.path(&format!("photos/{i}.png")), &photo).unwrap();
    }
    let mut document = read_decomposition(&toy.path("scene")).unwrap().document;
    document.terms = vec![TermDocument {
        name: "specular".into(),
        kept: false,
        evidence: "the photos are explained without <it>".into(),
        numbers: [].into(),
    }];
    write_decomposition(&toy.path("scene"), &document).unwrap();
    toy
}

#[test]
fn the_page_shows_photos_lights_components_and_what_was_left_out() {
    let toy = relit();
    let more = ["page.html", "--contact-sheet", "sheet.png", "--run", "dusk.run.json", "--json"];
    let done = run(&toy, env!("CARGO_BIN_EXE_report"), &[&REPORT[..], &more].concat());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!((&report["views"], &report["left_out"][0]), (&2.into(), &"specular".into()));
    // Four steps of 255: 20 log10(255 / 4), a little more where photos are white.
    let psnr = report["own_psnr_db"].as_f64().unwrap();
    assert!((36.0..37.5).contains(&psnr), "{psnr}");
    let html = std::fs::read_to_string(toy.path("page.html")).unwrap();
    for text in ["dusk: view view_1.png", "without &lt;it&gt;", "left out", "relight: dusk"] {
        assert!(html.contains(text), "{text}");
    }
    // Two views as photo, own light and dusk, the sheet of components, the light.
    assert_eq!(html.matches("data:image/").count(), 2 * 3 + 2);
    assert!(!html.contains("src=\"/") && !html.replace("http-equiv=", "").contains("http"));
    let sheet = read_image(&toy.path("sheet.png")).unwrap();
    assert!(sheet.width > 300 && sheet.height > 100);
}

#[test]
fn a_picture_that_is_missing_or_of_another_view_is_an_error_that_names_it() {
    let toy = relit();
    let program = env!("CARGO_BIN_EXE_report");
    let small = motes_scene::ImageU8::filled(8, 8, 3, 0);
    write_png(&toy.path("dusk/view_1.png"), &small).unwrap();
    let done = run(&toy, program, &[&REPORT[..], &["page.html"]].concat());
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(3), "{said}");
    assert!(said.contains("8 x 8 pixels") && said.contains("dusk/view_1.png"), "{said}");
    std::fs::remove_file(toy.path("dusk/view_1.png")).unwrap();
    let done = run(&toy, program, &[&REPORT[..], &["page.html"]].concat());
    assert_eq!(done.status.code(), Some(3));
    assert!(!toy.path("page.html").exists());
}
