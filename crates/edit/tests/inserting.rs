//! What `--insert` and `--swap` take, and where it comes to stand.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::process::{Command, Output};

use motes_formats::images::encode_png;
use motes_formats::ply::read_gaussians;
use motes_scene::{ImageU8, Materials};
use motes_testkit::toy_scene::{ToyScene, toy_scene};
use serde_json::Value;

fn edit(toy: &ToyScene, line: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_edit"));
    command.args(line).args(["--no-provenance", "--json", "-q", "-w"]);
    command.current_dir(toy.folder.path()).output().unwrap()
}

#[track_caller]
fn answer(done: &Output) -> Value {
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).unwrap()
}

#[track_caller]
fn refusal(done: &Output, code: i32) -> String {
    let text = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(code), "{text}");
    text
}

const SCENE: [&str; 4] = ["--scene", "scene", "--reshade-samples", "4"];

/// A box of 1 by 2 by 1 with y up: red and blue halves around, by a texture, as OBJ with its library.
fn put_box(toy: &ToyScene) {
    let row = [[255u8, 0, 0], [255, 0, 0], [0, 0, 255], [0, 0, 255]].concat();
    let image = ImageU8::from_data(4, 4, 3, [row.clone(), row.clone(), row.clone(), row].concat());
    std::fs::write(toy.path("halves.png"), encode_png(&image)).unwrap();
    std::fs::write(toy.path("box.mtl"), "newmtl halves\nmap_Kd halves.png\nPr 0.3\n").unwrap();
    let text = "mtllib box.mtl\nusemtl halves\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 2 0\nv 1 2 0\nv 1 2 1\nv 0 2 1\n\
        vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
        f 1/1 2/2 3/3 4/4\nf 8/1 7/2 6/3 5/4\nf 1/1 5/4 6/3 2/2\nf 2/1 6/4 7/3 3/2\nf 3/1 7/4 8/3 4/2\nf 4/1 8/4 5/3 1/2\n";
    std::fs::write(toy.path("box.obj"), text).unwrap();
}

#[test]
fn an_obj_stands_where_a_pixel_shows_the_ground_and_keeps_its_texture() {
    let toy = toy_scene();
    put_box(&toy);
    // Both spellings of the view; a corner of the picture, where the floor is.
    let view = toy.capture.views[0].name.clone();
    let bare = view.trim_end_matches(".png");
    let camera = toy.capture.cameras[toy.capture.views[0].camera].as_pinhole().unwrap();
    let (x, y) = (camera.width as f64 * 0.5, camera.height as f64 * 0.85);
    let places = [&view, bare].map(|name| {
        let at = format!("{name},{x},{y}");
        let line = [
            &SCENE[..],
            &["--capture", "capture.json", "--insert", "box.obj", "--at", &at],
            &["--height", "0.3", "--measure", "--thumbnails", "shots", "-o", "out"],
        ];
        let said = answer(&edit(&toy, &line.concat()));
        let numbers = &said["applied"][1]["numbers"];
        let number = |key: &str| numbers[key].as_f64().unwrap();
        assert!((number("height") - 0.3).abs() < 0.02, "its +y is up: {numbers}");
        assert!(number("base_z").abs() < 0.03, "on the floor: {numbers}");
        [number("base_x"), number("base_y")]
    });
    assert_eq!(places[0], places[1]);
    // The point that it stands on is seen at that pixel.
    let pose = toy.capture.views[0].camera_from_world;
    let p = pose.transform_point(glam::DVec3::new(places[0][0], places[0][1], 0.0));
    let seen = [camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy];
    assert!((seen[0] - x).abs() < 3.0 && (seen[1] - y).abs() < 3.0, "{seen:?} of {x}, {y}");
    let gaussians = read_gaussians(&toy.path("out/gaussians.ply")).unwrap();
    let before = read_gaussians(&toy.path("scene/gaussians.ply")).unwrap().len();
    let materials = Materials::of(&gaussians).unwrap();
    let colors = &materials.base_color_linear[before..];
    // Linear interpolation between texels mixes the colors at the seams.
    let share = |c: usize| {
        colors.iter().filter(|v| v[c] > 0.75 && v[2 - c] < 0.25 && v[1] < 1e-3).count() as f64
            / colors.len() as f64
    };
    assert!(share(0) > 0.3 && share(2) > 0.3, "both halves: {} {}", share(0), share(2));
    assert!(materials.roughness[before..].iter().all(|r| (r - 0.3).abs() < 1e-6));
    // Flat faces: normals along the axes of the box.
    let along = |n: &[f32; 3]| n.iter().any(|v| v.abs() > 0.999);
    assert!(materials.normals[before..].iter().all(along));
}

#[test]
fn the_default_place_is_free() {
    let toy = toy_scene();
    put_box(&toy);
    let line = ["--insert", "box.obj", "--height", "0.3", "--measure", "-o", "out"];
    let said = answer(&edit(&toy, &[&SCENE[..], &line].concat()));
    let numbers = &said["applied"][1]["numbers"];
    let number = |key: &str| numbers[key].as_f64().unwrap();
    // The box of the scene reaches 0.3 from the middle; half of a box of 0.15 is beside it.
    let beside = number("base_x").abs().max(number("base_y").abs());
    assert!(beside > 0.34, "inside of what is there: {numbers}");
    assert!(beside < 1.0 && number("base_z").abs() < 0.03, "{numbers}");
    // A second one finds a place of its own.
    let twice = [&["--insert", "box.obj"][..], &line].concat();
    let said = answer(&edit(&toy, &[&SCENE[..], &twice].concat()));
    let second = &said["applied"][2]["numbers"];
    let apart = (second["base_x"].as_f64().unwrap() - number("base_x"))
        .hypot(second["base_y"].as_f64().unwrap() - number("base_y"));
    assert!(apart > 0.1, "{second}");
}

#[test]
fn ground_that_came_along_is_refused_or_cropped() {
    let toy = toy_scene();
    let insert = ["--gaussians", "scene/gaussians.ply", "--insert", "scene/gaussians.ply"];
    let line = [&insert[..], &["-o", "both.ply"]].concat();
    let said = refusal(&edit(&toy, &line), 3);
    assert!(said.contains("whole capture") && said.contains("--surroundings crop"), "{said}");
    let count = |how: &str| {
        let said = answer(&edit(&toy, &[&line[..], &["--surroundings", how]].concat()));
        said["applied"][0]["gaussians"].as_u64().unwrap() as usize
    };
    let whole = read_gaussians(&toy.path("scene/gaussians.ply")).unwrap().len();
    let (kept, cropped) = (count("keep"), count("crop"));
    assert_eq!(kept, whole);
    assert!(cropped > 100 && cropped < whole / 2, "{cropped} of {whole}");
}

#[test]
fn mistakes_name_the_flag_and_what_can_be_inserted() {
    let toy = toy_scene();
    put_box(&toy);
    std::fs::write(toy.path("chair.fbx"), "Kaydara FBX Binary").unwrap();
    for (line, code, says) in [
        (&["--insert", "chair.fbx"][..], 3, ".glb, .gltf"),
        (&["--insert", "box.obj", "--at", "view_0,1,1"], 3, "give --capture"),
        (&["--insert", "box.obj", "--at", "view_0,1"], 2, "--at takes VIEW,X,Y"),
        (&["--merge", "box.obj", "--at", "view_0,1,1"], 3, "a shift of three numbers"),
        (&["--insert", "box.obj", "--height", "0"], 3, "above 0"),
        (&["--delete", "--height", "1"], 2, "--height goes with"),
        (&["--insert", "box.obj", "--at", "no,1,1", "--capture", "capture.json"], 3, "view_"),
        (
            &["--insert", "box.obj", "--at", "view_0,1,9999", "--capture", "capture.json"],
            3,
            "outside the view",
        ),
    ] {
        let said = refusal(&edit(&toy, &[&SCENE[..], line, &["-o", "out"]].concat()), code);
        assert!(said.contains(says), "{line:?}: {said}");
    }
}
