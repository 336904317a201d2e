//! The stage `render` as a program: views, paths, files, exit codes.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::process::Output;

use motes_formats::camera_path::{CameraPathDocument, write_camera_path};
use motes_formats::capture::write_capture;
use motes_formats::exr_aov::read_exr;
use motes_formats::images::read_image;
use motes_formats::ply::{PlyWriteOptions, read_gaussians, write_gaussians};
use motes_scene::{ExposureResponse, Materials};
use motes_testkit::toy_capture::{ToyCapture, assert_code, run, stderr, toy_capture};
use motes_testkit::toy_scene::toy_scene;

fn render(toy: &ToyCapture, arguments: &[&str]) -> Output {
    let mut all = vec!["--gaussians", "true.ply", "--no-provenance"];
    all.extend(arguments);
    run(env!("CARGO_BIN_EXE_render"), toy.folder.path(), &all)
}

fn files(toy: &ToyCapture, folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(toy.path(folder)).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn views_are_rendered_under_their_names() {
    let toy = toy_capture();
    let done = render(&toy, &["--capture", "capture.json", "--split", "test", "-o", "renders/"]);
    assert_code(&done, 0);
    assert!(done.stdout.is_empty());
    assert_eq!(files(&toy, "renders"), ["view_2.png", "view_5.png"]);
    let (photo, render) = (toy.path("images/view_2.png"), toy.path("renders/view_2.png"));
    assert_eq!(read_image(&photo).unwrap(), read_image(&render).unwrap());
}

#[test]
fn polished_metal_in_a_scene_is_sent_to_relight() {
    let toy = toy_scene();
    let warned = |metallic: f32| {
        let path = toy.folder.path().join("scene/gaussians.ply");
        let mut gaussians = read_gaussians(&path).unwrap();
        let mut materials = Materials::of(&gaussians).unwrap();
        materials.roughness[..100].fill(0.1);
        materials.metallic[..100].fill(metallic);
        materials.attach(&mut gaussians);
        write_gaussians(&path, &gaussians, &PlyWriteOptions::default()).unwrap();
        let line = ["--scene", "scene", "--capture", "capture.json", "--split", "test"];
        let more = ["-o", "out", "-w", "--dry-run"];
        let done =
            run(env!("CARGO_BIN_EXE_render"), toy.folder.path(), &[&line[..], &more[..]].concat());
        assert_code(&done, 0);
        stderr(&done).contains("100 Gaussians are of polished metal")
    };
    assert!(warned(1.0));
    assert!(!warned(0.0));
}

#[test]
fn existing_pictures_are_kept() {
    let toy = toy_capture();
    std::fs::create_dir(toy.path("out")).unwrap();
    std::fs::write(toy.path("out/view_2.png"), b"mine").unwrap();
    let split = ["--capture", "capture.json", "--split", "test", "-o", "out"];
    assert_code(&render(&toy, &split), 2);
    assert_eq!(std::fs::read(toy.path("out/view_2.png")).unwrap(), b"mine");
    assert_eq!(files(&toy, "out").len(), 1, "nothing was rendered");
    assert_code(&render(&toy, &[&split[..], &["-w"]].concat()), 0);
    assert_ne!(std::fs::read(toy.path("out/view_2.png")).unwrap(), b"mine");
}

#[test]
fn the_ends_of_between_are_the_views() {
    let toy = toy_capture();
    let between = |t: &str, folder: &str| {
        let arguments = [
            "--capture",
            "capture.json",
            "--between",
            "view_2.png",
            "view_5.png",
            "--t",
            t,
            "-o",
            folder,
        ];
        assert_code(&render(&toy, &arguments), 0);
        let name = &files(&toy, folder)[0];
        read_image(&toy.path(folder).join(name)).unwrap()
    };
    let photo = |name: &str| read_image(&toy.path("images").join(name)).unwrap();
    assert_eq!(between("0", "a"), photo("view_2.png"));
    assert_eq!(between("1", "b"), photo("view_5.png"));
    let half = between("0.5", "c");
    assert!(half != photo("view_2.png") && half != photo("view_5.png"));
}

#[test]
fn paths_are_numbered_and_tell_how_to_make_a_video() {
    let toy = toy_capture();
    for (path, folder) in [("--orbit", "o"), ("--spiral", "s")] {
        let done = render(&toy, &["--capture", "capture.json", path, "3", "-o", folder]);
        assert_code(&done, 0);
        assert_eq!(files(&toy, folder), ["frame_0000.png", "frame_0001.png", "frame_0002.png"]);
        assert!(stderr(&done).contains("ffmpeg -y -framerate 30 -i "), "{}", stderr(&done));
        // What the cameras look at is in the picture.
        let picture = read_image(&toy.path(folder).join("frame_0001.png")).unwrap();
        assert!(picture.data.iter().any(|&v| v > 60), "{path}");
    }
}

#[test]
fn an_orbit_needs_no_capture() {
    let toy = toy_capture();
    let line = ["--orbit", "4", "--up", "0,0,1", "--width", "96", "-o", "around"];
    assert_code(&render(&toy, &line), 0);
    let frames: Vec<_> = files(&toy, "around");
    assert_eq!(frames.len(), 4);
    let pictures: Vec<_> =
        frames.iter().map(|f| read_image(&toy.path("around").join(f)).unwrap()).collect();
    for picture in &pictures {
        assert_eq!((picture.width, picture.height), (96, 72));
        // The object is in the middle of each.
        let middle = (36 * 96 + 48) * 3;
        assert!(picture.data[middle..middle + 3].iter().any(|v| *v > 20));
    }
    assert_ne!(pictures[0], pictures[2]);
    // Up is about a capture that there is not, and says nothing beside one.
    let both = ["--orbit", "4", "--up", "0,0,1", "--capture", "capture.json", "-o", "no"];
    assert_code(&render(&toy, &both), 2);
    for wrong in ["0,0,0", "0,0", "a,0,0,1", "nan,0,0"] {
        assert_code(&render(&toy, &["--orbit", "4", "--up", wrong, "-o", "no"]), 2);
    }
    assert!(!toy.path("no").exists());
}

#[test]
fn a_camera_path_needs_no_capture() {
    let toy = toy_capture();
    let camera = toy.capture.cameras[0].as_pinhole().unwrap();
    let poses = [toy.capture.views[2].camera_from_world];
    let document = CameraPathDocument::new(&camera, 30.0, &poses);
    write_camera_path(&toy.path("path.json"), &document).unwrap();
    assert_code(&render(&toy, &["--path", "path.json", "-o", "out"]), 0);
    let picture = read_image(&toy.path("out/frame_0000.png")).unwrap();
    let photo = read_image(&toy.path("images/view_2.png")).unwrap();
    let far = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 1;
    assert_eq!(picture.data.iter().zip(&photo.data).filter(|p| far(*p)).count(), 0);
}

#[test]
fn sizes_formats_and_aovs() {
    let toy = toy_capture();
    let arguments = [
        "--capture",
        "capture.json",
        "--view",
        "view_0.png",
        "--width",
        "32",
        "--format",
        "both",
        "--aov",
        "depth,normal,alpha",
        "--background",
        "white",
        "-o",
        "out",
    ];
    assert_code(&render(&toy, &arguments), 0);
    let expected =
        ["view_0.alpha.png", "view_0.depth.png", "view_0.exr", "view_0.normal.png", "view_0.png"];
    assert_eq!(files(&toy, "out"), expected);
    let png = read_image(&toy.path("out/view_0.png")).unwrap();
    assert_eq!((png.width, png.height), (32, 24));
    assert_eq!(png.pixel(0, 0), [255; 3], "the corner is background");
    let (width, height, channels) = read_exr(&toy.path("out/view_0.exr")).unwrap();
    assert_eq!((width, height), (32, 24));
    let of = |name: &str| channels.iter().find(|c| c.name == name).unwrap().to_f32();
    let center = 12 * 32 + 16;
    assert!(of("A")[center] > 0.9 && of("A")[0] < 0.01);
    let depth = of("depth.Z")[center];
    assert!((2.5..5.5).contains(&depth), "the scene is 4.3 away: {depth}");
    assert!((of("depth_median.Z")[center] - depth).abs() < 1.0);
    let length: f32 =
        ["X", "Y", "Z"].iter().map(|a| of(&format!("normal.{a}"))[center].powi(2)).sum();
    assert!((length - 1.0).abs() < 1e-3, "{length}");
    let encoded = f32::from(png.pixel(16, 12)[0]) / 255.0;
    let linear = ((encoded + 0.055) / 1.055).powf(2.4);
    let stored = of("R")[center];
    assert!(encoded < 0.05 || (stored - linear).abs() < 0.01, "{stored} {linear}");
}

#[test]
fn panoramas_have_their_own_size() {
    let toy = toy_capture();
    let arguments = [
        "--capture",
        "capture.json",
        "--view",
        "view_0.png",
        "--projection",
        "equirect",
        "--width",
        "64",
        "-o",
        "out",
    ];
    assert_code(&render(&toy, &arguments), 0);
    let picture = read_image(&toy.path("out/view_0.png")).unwrap();
    assert_eq!((picture.width, picture.height), (64, 32));
}

#[test]
fn impossible_requests_are_named() {
    let toy = toy_capture();
    let capture = ["--capture", "capture.json", "-o", "out"];
    let with = |more: &[&str]| render(&toy, &[&capture[..], more].concat());
    let unknown = with(&["--view", "view_9.png"]);
    assert_code(&unknown, 3);
    assert!(stderr(&unknown).contains("view_9.png") && stderr(&unknown).contains("view_0.png"));
    assert_code(&with(&[]), 2);
    assert_code(&with(&["--orbit", "3", "--split", "test"]), 2);
    assert_code(&with(&["--between", "view_0.png", "view_1.png", "--t", "1.5"]), 2);
    assert_code(&with(&["--split", "test", "--t", "0.5"]), 2);
    assert!(!toy.path("out").exists(), "no folder is left behind");
}

#[test]
fn the_report_is_the_only_thing_on_stdout() {
    let toy = toy_capture();
    let arguments = ["--capture", "capture.json", "--orbit", "2", "-o", "out", "--json"];
    let done = render(&toy, &arguments);
    assert_code(&done, 0);
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(
        (&report["pictures"], &report["gaussians"]),
        (&2.into(), &toy.gaussians.len().into())
    );
    assert!(report["video_command"].as_str().unwrap().starts_with("ffmpeg "));
}

/// The capture says that view_2 was exposed one stop more than view_5, and the PLY, which factor
/// that is: their pictures differ by it, unless the model's own brightness is asked for.
#[test]
fn views_have_the_exposure_of_their_photos() {
    let toy = toy_capture();
    let mut capture = toy.capture.clone();
    let slope = 0.2;
    let response = ExposureResponse { slope_per_stop: slope, reference_stops: -9.0 };
    for (name, stops) in [("view_2.png", -8.0), ("view_5.png", -9.0)] {
        let view = capture.view_named(name).unwrap();
        capture.views[view].exposure_stops = Some(stops);
    }
    write_capture(&toy.path("capture.json"), &capture).unwrap();
    let options = PlyWriteOptions { exposure_response: Some(response), ..Default::default() };
    write_gaussians(&toy.path("exposed.ply"), &toy.gaussians, &options).unwrap();
    let mean = |folder: &str, name: &str| {
        let image = read_image(&toy.path(folder).join(name)).unwrap();
        image.data.iter().map(|&v| f64::from(v)).sum::<f64>() / image.data.len() as f64
    };
    let draw = |folder: &str, gaussians: &str, more: &[&str]| {
        let arguments = [
            "--capture",
            "capture.json",
            "--split",
            "test",
            "-o",
            folder,
            "--gaussians",
            gaussians,
        ];
        let all = [&arguments[..], &["--no-provenance"], more].concat();
        assert_code(&run(env!("CARGO_BIN_EXE_render"), toy.folder.path(), &all), 0);
        [mean(folder, "view_2.png"), mean(folder, "view_5.png")]
    };
    let plain = draw("plain", "true.ply", &[]);
    let exposed = draw("exposed", "exposed.ply", &[]);
    // Less than the gain where values are clipped at white.
    let gain = exposed[0] / plain[0];
    assert!(gain > 1.0 + 0.5 * slope && gain < slope.exp() + 0.02, "{gain}");
    assert_eq!(exposed[1], plain[1], "the reference exposure changes nothing");
    assert_eq!(draw("model", "exposed.ply", &["--view-exposure", "model"]), plain);
}
