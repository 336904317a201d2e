//! `export` to pages, meshes and shadows: the command line, without other people's programs.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::Path;
use std::process::{Command, Output};

use motes_formats::environment::read_environment;
use motes_formats::images::{read_image, write_png};
use motes_formats::ply::{PlyWriteOptions, read_surface, write_gaussians, write_surface};
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, Surface};
use motes_testkit::toy_scene::{ToyScene, toy_scene};

fn export(scene: &ToyScene, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_export"));
    command.arg("--no-provenance").args(arguments).current_dir(scene.folder.path());
    command.output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[track_caller]
fn assert_code(output: &Output, code: i32) {
    assert_eq!(output.status.code(), Some(code), "{}", stderr(output));
}

/// Pictures of the capture, so that a page has photos.
fn with_photos(scene: &ToyScene) {
    let gaussians = motes_formats::ply::read_gaussians(&scene.path("scene/gaussians.ply")).unwrap();
    std::fs::create_dir(scene.path("images")).unwrap();
    let camera = scene.capture.cameras[0].as_pinhole().unwrap();
    for view in &scene.capture.views {
        let photo = render(&gaussians, &camera, &view.camera_from_world, &RenderOptions::default());
        write_png(&scene.path("").join(&view.image), &photo.color.to_u8()).unwrap();
    }
}

fn json_chunk(path: &Path) -> serde_json::Value {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..4], b"glTF");
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

#[test]
fn a_page_holds_the_splat_the_photos_and_the_light() {
    let scene = toy_scene();
    with_photos(&scene);
    let output = export(
        &scene,
        &[
            "--scene",
            "scene",
            "--capture",
            "capture.json",
            "--photos",
            "1",
            "--json",
            "-o",
            "a.html",
        ],
    );
    assert_code(&output, 0);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let contents = &report["contents"];
    assert_eq!((&contents["photos"], &contents["lights"]), (&1.into(), &1.into()), "{report}");
    assert_eq!(contents["splats"][0]["gaussians"], 48 * 48 + 500);
    let page = std::fs::read_to_string(scene.path("a.html")).unwrap();
    let manifest = page.split(r#"id="manifest">"#).nth(1).unwrap().split("</script>").next();
    let manifest: serde_json::Value = serde_json::from_str(manifest.unwrap()).unwrap();
    assert_eq!(manifest["photos"][0]["name"], "view_2.png", "the held-out view");
    assert_eq!(manifest["splats"][0]["materials"], true);
    assert_eq!(manifest["lights"][0]["harmonics"].as_array().unwrap().len(), 75);
    // The same bytes again, and never over an existing page by itself.
    let again = ["--scene", "scene", "--capture", "capture.json", "--photos", "1", "-o", "a.html"];
    assert_code(&export(&scene, &again), 2);
    let mut again = again.to_vec();
    again.extend(["--overwrite", "--threads", "1"]);
    assert_code(&export(&scene, &again), 0);
    assert_eq!(std::fs::read_to_string(scene.path("a.html")).unwrap(), page);
}

#[test]
fn a_page_of_plain_gaussians_and_one_to_compare_with() {
    let scene = toy_scene();
    let line = [
        "scene/gaussians.ply",
        "--compare-with",
        "scene/gaussians.ply",
        "--title",
        "<b>",
        "--format",
        "html",
    ];
    let output = export(&scene, &[&line[..], &["-o", "page.txt"]].concat());
    assert_code(&output, 0);
    let page = std::fs::read_to_string(scene.path("page.txt")).unwrap();
    assert!(page.contains("<title>&lt;b&gt;</title>") && page.contains("id=\"splat-1-0\""));
    assert!(page.contains("\"lights\":[]") && page.contains("\"photos\":[]"));
}

#[test]
fn a_mesh_has_textures_and_its_light_in_the_targets_axes() {
    let scene = toy_scene();
    // Blender's axes: light from +x, left of the center +y.
    scene.map("sky.exr", 16, 8, |x, _| if x == 8 { [4.0, 2.0, 1.0] } else { [0.1; 3] });
    let light = ["--environment", "sky.exr", "--env-convention", "blender"];
    let mesh = ["--scene", "scene", "--format", "mesh", "--texture-size", "256"];
    let output = export(&scene, &[&mesh[..], &light, &["-o", "m.glb"]].concat());
    assert_code(&output, 0);
    let document = json_chunk(&scene.path("m.glb"));
    assert_eq!(document["images"].as_array().unwrap().len(), 3);
    assert_eq!(document["extensionsUsed"][0], "KHR_materials_specular", "the toy is matte");
    assert_eq!(
        document["nodes"][0]["extras"]["gltf_from_world"][1],
        serde_json::json!([0.0, 0.0, 1.0, 0.0])
    );
    // The world has z up, as Blender: no pixel of the map moves, in any of its files.
    let given = read_environment(&scene.path("sky.exr")).unwrap();
    let exr = read_environment(&scene.path("m.environment.exr")).unwrap();
    let far = |a: &motes_scene::ImageF32, b: &motes_scene::ImageF32| {
        a.data.iter().zip(&b.data).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert_eq!((exr.width, exr.height), (16, 8));
    assert!(far(&exr, &given) < 1e-3, "{}", far(&exr, &given));
    assert!(far(&read_environment(&scene.path("m.environment.hdr")).unwrap(), &exr) < 0.03);
    // OpenUSD has another center: the same light a quarter further.
    let usd = [&mesh[..], &light, &["--target", "usd", "-o", "u.glb"]].concat();
    assert_code(&export(&scene, &usd), 0);
    let usd = read_environment(&scene.path("u.environment.exr")).unwrap();
    let brightest = |image: &motes_scene::ImageF32| {
        (0..16).max_by(|a, b| image.pixel(*a, 4)[0].total_cmp(&image.pixel(*b, 4)[0])).unwrap()
    };
    assert_eq!((brightest(&exr), brightest(&usd)), (8, 4));
}

#[test]
fn a_mesh_without_an_atlas_has_colors_at_its_vertices() {
    let scene = toy_scene();
    let line =
        ["--scene", "scene", "--format", "mesh", "--no-atlas", "--triangles", "0", "-o", "m.glb"];
    assert_code(&export(&scene, &line), 0);
    let document = json_chunk(&scene.path("m.glb"));
    let attributes = &document["meshes"][0]["primitives"][0]["attributes"];
    assert!(attributes["COLOR_0"].is_u64() && attributes["_ROUGHNESS"].is_u64());
    assert!(document.get("images").is_none());
}

#[test]
fn a_shadow_is_dark_behind_the_box_and_nowhere_else() {
    let scene = toy_scene();
    let sun = ["--sun", "azimuth=0,elevation=45", "--env-exposure", "1"];
    let line =
        ["--scene", "scene", "--format", "shadow-plane", "--shadow-size", "64", "-o", "s.glb"];
    assert_code(&export(&scene, &[&line[..], &sun].concat()), 0);
    let picture = read_image(&scene.path("s.png")).unwrap();
    // The box is 0.6 wide, the plane 2.4: the sun stands over +x, the shadow falls to -x.
    let at = |x: f32, y: f32| {
        let place = |v: f32, n: usize| ((0.5 + v / 2.4) * n as f32) as usize;
        picture.pixel(place(x, picture.width), place(-y, picture.height))[0]
    };
    assert!(at(-0.5, 0.0) < 10, "{}", at(-0.5, 0.0));
    for (x, y) in [(0.6, 0.0), (0.0, 0.7), (-0.5, -0.7), (-1.1, 0.0)] {
        assert!(at(x, y) > 245, "{x} {y}: {}", at(x, y));
    }
    let document = json_chunk(&scene.path("s.glb"));
    assert_eq!(document["materials"][0]["alphaMode"], "BLEND");
}

#[test]
fn what_cannot_be_a_mesh_says_why_and_leaves_nothing() {
    let scene = toy_scene();
    for (line, code, says) in [
        (&["scene/gaussians.ply", "--format", "mesh", "-o", "m.glb"][..], 2, "run decompose"),
        (&["--scene", "scene", "--format", "mesh", "-o", "-"], 2, "needs a name"),
        (&["--scene", "scene", "--format", "mesh", "--unit", "0", "-o", "m.glb"], 2, "above 0"),
        (
            &["--scene", "scene", "--format", "mesh", "--texture-size", "9", "-o", "m.glb"],
            2,
            "64..=8192",
        ),
        (&["--scene", "nowhere", "--format", "mesh", "-o", "m.glb"], 3, "nowhere"),
        (&["scene/gaussians.ply", "--compare-with", "none.ply", "-o", "a.html"], 3, "none.ply"),
        (&["scene/gaussians.ply", "--capture", "none.json", "-o", "a.html"], 3, "none.json"),
        (
            &["scene/gaussians.ply", "--html", "--format", "ply", "-o", "a.html"],
            2,
            "cannot be used",
        ),
    ] {
        let output = export(&scene, line);
        assert_code(&output, code);
        assert!(stderr(&output).contains(says), "{line:?}: {}", stderr(&output));
    }
    let surface = read_surface(&scene.path("scene/surface.ply")).unwrap();
    let floor = Surface { triangles: surface.triangles[..2 * 48 * 48].to_vec(), ..surface.clone() };
    let none = Surface { triangles: Vec::new(), ..surface.clone() };
    for (surface, format, says) in [
        (&none, "mesh", "no triangles"),
        (&none, "shadow-plane", "no ground"),
        (&floor, "shadow-plane", "nothing stands on the ground"),
    ] {
        write_surface(&scene.path("scene/surface.ply"), surface).unwrap();
        let output = export(&scene, &["--scene", "scene", "--format", format, "-o", "m.glb"]);
        assert_code(&output, 3);
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
    write_gaussians(&scene.path("zero.ply"), &Gaussians::empty(0), &PlyWriteOptions::default())
        .unwrap();
    let output = export(&scene, &["zero.ply", "-o", "a.html"]);
    assert_code(&output, 3);
    let left: Vec<String> = std::fs::read_dir(scene.folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| !["scene", "capture.json", "zero.ply"].contains(&name.as_str()))
        .collect();
    assert!(left.is_empty(), "left behind: {left:?}");
}
