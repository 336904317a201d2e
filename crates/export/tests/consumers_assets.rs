//! Browsers, viewers, validators and renderers open what `export` writes, and show what we show.
//!
//! `make setup-consumers` installs them. Without one of them its tests say that they were skipped; with `CI` set
//! they fail. `MOTES_PICTURES` names a folder that keeps the pictures for looking at.

#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]
#![allow(clippy::print_stdout, reason = "shown with --nocapture")]

use std::path::{Path, PathBuf};
use std::process::Command;

use motes_formats::camera_path::read_camera_path;
use motes_formats::capture::write_capture;
use motes_formats::exr_aov::open_exr;
use motes_formats::images::{read_image, write_png};
use motes_formats::ply::{PlyWriteOptions, read_gaussians, write_gaussians};
use motes_math::metrics::psnr_f32;
use motes_math::srgb;
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, ImageF32, ImageU8, Materials, Pinhole, Pose, View};
use motes_testkit::toy_scene::{ToyScene, toy_scene};
use motes_testkit::{consumer, random_gaussians};

/// What the issue of these exports asks of a picture by another program.
const LEAST_DB: f64 = 30.0;
/// And of a path tracer's.
const LEAST_RENDERER_DB: f64 = 25.0;
/// The held-out view.
const VIEW: usize = 2;

/// Runs a script of `scripts/consumers` in the folder of the installed packages; its standard output.
#[track_caller]
fn script(packages: &Path, name: &str, arguments: &[&Path], words: &[&str]) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scripts/consumers").join(name);
    let mut command = Command::new("node");
    command.arg(path).args(arguments).args(words).current_dir(packages);
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {said}{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stdout).unwrap()
}

#[track_caller]
fn stage(program: &str, folder: &Path, arguments: &[&str]) {
    let mut command = Command::new(program);
    command.arg("--no-provenance").args(arguments).current_dir(folder);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

const EXPORT: &str = env!("CARGO_BIN_EXE_export");

/// A decomposed scene whose Gaussians have harmonics, with photos of it.
fn scene_with_photos() -> ToyScene {
    let scene = toy_scene();
    let path = scene.path("scene/gaussians.ply");
    let mut gaussians = read_gaussians(&path).unwrap().with_sh_degree(3);
    for (i, sh) in gaussians.sh.iter_mut().enumerate().filter(|(i, _)| i % 48 >= 3) {
        *sh = 0.3 * ((i as f32 * 0.618).fract() - 0.5);
    }
    write_gaussians(&path, &gaussians, &PlyWriteOptions::default()).unwrap();
    std::fs::create_dir(scene.path("images")).unwrap();
    for view in &scene.capture.views {
        let photo = picture(&gaussians, &scene, view);
        write_png(&scene.path("").join(&view.image), &photo.to_u8()).unwrap();
    }
    scene
}

fn camera(scene: &ToyScene) -> Pinhole {
    scene.capture.cameras[0].as_pinhole().unwrap()
}

fn picture(gaussians: &Gaussians, scene: &ToyScene, view: &View) -> ImageF32 {
    render(gaussians, &camera(scene), &view.camera_from_world, &RenderOptions::default()).color
}

/// The same Gaussians with one color each, as the rasterizer takes them.
fn colored(gaussians: &Gaussians, color: impl Fn(usize) -> [f32; 3]) -> Gaussians {
    let coefficient = |v: f32| (v - 0.5) / 0.282_094_8;
    let sh = (0..gaussians.len()).flat_map(|i| color(i).map(coefficient)).collect();
    Gaussians { sh_degree: 0, sh, ..gaussians.clone() }
}

#[track_caller]
fn assert_agree(what: &str, path: &Path, ours: &ImageF32, least: f64) {
    let theirs = read_image(path).unwrap();
    let rgb: Vec<f32> = theirs
        .data
        .chunks_exact(theirs.channels)
        .flat_map(|p| [p[0], p[1], p[2]])
        .map(|v| f32::from(v) / 255.0)
        .collect();
    let ours = ours.to_u8().to_f32();
    assert_eq!((theirs.width, theirs.height), (ours.width, ours.height), "{what}");
    let found = psnr_f32(&rgb, &ours.data);
    println!("{what}: {found:.1} dB");
    if let Some(folder) = std::env::var_os("MOTES_PICTURES").map(PathBuf::from) {
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::copy(path, folder.join(format!("{what}-theirs.png"))).unwrap();
        write_png(&folder.join(format!("{what}-ours.png")), &ours.to_u8()).unwrap();
    }
    assert!(found >= least, "{what}: {found:.2} dB < {least}");
}

#[test]
fn chromium_points_at_the_page_and_copies_what_other_stages_take() {
    let (Some(browser), Some(_)) = (consumer("chromium"), consumer("node_modules/playwright-core"))
    else {
        return;
    };
    let scene = scene_with_photos();
    let line = ["--scene", "scene", "--capture", "capture.json", "-o", "page.html"];
    // Photos of half the size: pixels are those of the capture all the same.
    let half = (camera(&scene).width.max(camera(&scene).height) / 2).to_string();
    stage(EXPORT, scene.folder.path(), &[&line[..], &["--photo-size", &half]].concat());
    let view = &scene.capture.views[VIEW];
    let pinhole = camera(&scene);
    let pixel = [pinhole.width / 2, pinhole.height * 3 / 4];
    let pictures = scene.path("pictures");
    std::fs::create_dir(&pictures).unwrap();
    let [x, y] = pixel.map(|v| v.to_string());
    let files = [scene.path("page.html"), pictures.clone()];
    let said = script(
        browser.parent().unwrap(),
        "page-pointer.mjs",
        &[&files[0], &files[1]],
        &[&view.name, &x, &y],
    );
    if let Some(folder) = std::env::var_os("MOTES_PICTURES").map(PathBuf::from) {
        for name in ["photo.png", "free.png"] {
            std::fs::copy(pictures.join(name), folder.join(format!("pointer-{name}"))).unwrap();
        }
    }
    let report: serde_json::Value = serde_json::from_str(&said).unwrap();
    // The pixel that it says: that of the capture, to a pixel of the half-sized photo.
    let named = |text: &str| -> (String, [f64; 2]) {
        let text = text.trim_start_matches("--click ");
        let parts: Vec<&str> = text.lines().next().unwrap().rsplitn(3, ',').collect();
        (parts[2].to_owned(), [parts[1].parse().unwrap(), parts[0].parse().unwrap()])
    };
    let copied = report["photo"]["copied"].as_str().unwrap();
    assert!(copied.starts_with("--click "), "{report}");
    for text in [copied, report["hover"].as_str().unwrap()] {
        let (name, at) = named(text);
        assert_eq!(name, view.name, "{text}");
        assert!((0..2).all(|k| (at[k] - pixel[k] as f64).abs() <= 2.0), "{pixel:?}: {text}");
    }
    assert_eq!(report["dragged"], "", "a drag is no click");
    // The point under a click of the free camera lies on what the photo that was named shows there.
    let point: [f64; 3] = serde_json::from_value(report["free"]["point"].clone()).unwrap();
    let (name, at) = named(report["free"]["copied"].as_str().unwrap());
    let seen = &scene.capture.views[scene.capture.view_named(&name).unwrap()];
    let p = seen.camera_from_world.transform_point(glam::DVec3::from_array(point));
    let projected = [pinhole.fx * p.x / p.z + pinhole.cx, pinhole.fy * p.y / p.z + pinhole.cy];
    assert!((0..2).all(|k| (projected[k] - at[k]).abs() <= 2.0), "{projected:?}: {report}");
    let gaussians = read_gaussians(&scene.path("scene/gaussians.ply")).unwrap();
    let options = RenderOptions { aovs: true, ..RenderOptions::default() };
    let drawn = render(&gaussians, &pinhole, &seen.camera_from_world, &options).aovs.unwrap();
    let depth = f64::from(drawn.depth_expected.pixel(at[0] as usize, at[1] as usize)[0]);
    assert!((depth / p.z - 1.0).abs() < 0.05, "{depth} at {p}");
    // The path that it copies is one that render takes, of the camera that clicked.
    let path = read_camera_path(&pictures.join("path.json")).unwrap();
    let (lens, pose) = path.frames[0];
    let q = pose.transform_point(glam::DVec3::from_array(point));
    let size = [lens.width as f64, lens.height as f64];
    let focal = lens.fy;
    // The window is 1000 x 700 and the frame fits into its middle.
    let fit = (1000.0 / size[0]).min(700.0 / size[1]);
    let window = [500.0 + fit * focal * q.x / q.z, 350.0 + fit * focal * q.y / q.z];
    assert!((window[0] - 500.0).abs() < 3.0 && (window[1] - 400.0).abs() < 3.0, "{window:?}");
}

#[test]
fn chromium_draws_the_page_and_its_components_as_we_do() {
    let (Some(browser), Some(_)) = (consumer("chromium"), consumer("node_modules/playwright-core"))
    else {
        return;
    };
    let scene = scene_with_photos();
    stage(
        EXPORT,
        scene.folder.path(),
        &["--scene", "scene", "--capture", "capture.json", "-o", "page.html"],
    );
    let view = &scene.capture.views[VIEW];
    let modes = ["appearance", "base_color", "normal", "roughness", "visibility", "relit"];
    let mut words = vec![view.name.as_str()];
    words.extend(modes);
    let pictures = scene.path("pictures");
    std::fs::create_dir(&pictures).unwrap();
    let packages = browser.parent().unwrap();
    let said =
        script(packages, "page-pictures.mjs", &[&scene.path("page.html"), &pictures], &words);
    let report: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!(report["outside"], serde_json::json!([]), "the page asked for something");

    let gaussians = read_gaussians(&scene.path("scene/gaussians.ply")).unwrap();
    let m = Materials::of(&gaussians).unwrap();
    for mode in modes {
        // The light is 0.5 from everywhere and nothing is hidden: E / π is 0.5, and the coat
        // reflects a little of the same light.
        let lit = |i: usize| m.base_color_linear[i].map(|b| srgb::encode(0.5 * b + 0.5 * 0.04));
        let ours = match mode {
            "appearance" => gaussians.clone(),
            "base_color" => colored(&gaussians, |i| m.base_color_linear[i].map(srgb::encode)),
            "normal" => colored(&gaussians, |i| m.normals[i].map(|v| 0.5 + 0.5 * v)),
            "roughness" => colored(&gaussians, |i| [m.roughness[i]; 3]),
            "visibility" => colored(&gaussians, |i| [m.visibility[i]; 3]),
            _ => colored(&gaussians, lit),
        };
        let ours = picture(&ours, &scene, view);
        assert_agree(mode, &pictures.join(format!("{mode}.png")), &ours, LEAST_DB);
    }
    let screen = read_image(&pictures.join("screen.png")).unwrap();
    assert_eq!((screen.width, screen.height), (800, 600));
}

#[test]
fn three_js_with_spark_shows_our_files_as_we_do() {
    let (Some(browser), Some(_)) =
        (consumer("chromium"), consumer("node_modules/@sparkjsdev/spark"))
    else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let mut gaussians = random_gaussians(3, 2500, 3);
    // As fine as fitted ones are: fog of a few large ones is a test of sorting alone.
    gaussians.log_scales.iter_mut().flatten().for_each(|s| *s -= 1.2);
    write_gaussians(&dir.path().join("a.ply"), &gaussians, &PlyWriteOptions::default()).unwrap();
    let pinhole = Pinhole { fx: 260.0, fy: 255.0, cx: 131.0, cy: 97.0, width: 256, height: 192 };
    let pose = Pose::look_at(
        glam::DVec3::new(2.2, -1.1, 0.9),
        glam::DVec3::ZERO,
        glam::DVec3::new(0.1, -1.0, 0.2),
    )
    .unwrap();
    let ours = render(&gaussians, &pinhole, &pose, &RenderOptions::default()).color;
    for (name, is_flipped) in [("a.ply", false), ("b.spz", true), ("c.sog", false)] {
        if name != "a.ply" {
            stage(EXPORT, dir.path(), &["a.ply", "-o", name]);
        }
        let matrix = pose.rotation_matrix();
        let rotation = [0, 1, 2].map(|k| matrix.row(k).to_array());
        let camera = serde_json::json!({
            "width": pinhole.width, "height": pinhole.height,
            "fx": pinhole.fx, "fy": pinhole.fy, "cx": pinhole.cx, "cy": pinhole.cy,
            "rotation": rotation,
            "eye": pose.center_in_world().to_array(), "flip": is_flipped,
        });
        let path = |name: &str| dir.path().join(name);
        std::fs::write(path("camera.json"), camera.to_string()).unwrap();
        let files = [path(name), path("camera.json"), path("out.png")];
        let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
        let said = script(browser.parent().unwrap(), "spark-picture.mjs", &files, &[]);
        assert!(said.contains("\"stable\":true"), "{said}");
        assert_agree(&format!("spark-{name}"), &path("out.png"), &ours, LEAST_DB);
    }
}

#[test]
fn the_khronos_validator_finds_no_error() {
    let Some(validator) = consumer("node_modules/gltf-validator") else { return };
    let scene = toy_scene();
    let of = |name: &str, more: &[&str]| {
        let line = [&["--scene", "scene", "-o", name][..], more].concat();
        stage(EXPORT, scene.folder.path(), &line);
        scene.path(name)
    };
    let files = [
        of("textures.glb", &["--format", "mesh", "--texture-size", "256"]),
        of("vertices.glb", &["--format", "mesh", "--no-atlas", "--unit", "0.01"]),
        of("shadow.glb", &["--format", "shadow-plane", "--shadow-size", "32"]),
    ];
    let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
    let packages = validator.parent().and_then(Path::parent).unwrap();
    println!("{}", script(packages, "validate-gltf.mjs", &files, &[]));
}

#[test]
fn blender_lights_the_mesh_as_relight_lights_the_scene() {
    let Some(blender) = consumer("blender/bin/python") else { return };
    let scene = toy_scene();
    // A bright side and a dim sky: shadows tell where the light stands, and so whose axes it has.
    scene.map("scene/environment.exr", 64, 32, |x, y| {
        if (8..14).contains(&x) && (6..12).contains(&y) {
            [9.0, 8.0, 6.0]
        } else {
            [0.25, 0.3, 0.4]
        }
    });
    assert_blender_agrees(&blender, &scene, "blender");
}

/// Blender path-traces the mesh of the scene folder `scene` under its light as `relight` lights its Gaussians.
#[track_caller]
fn assert_blender_agrees(blender: &Path, scene: &ToyScene, what: &str) {
    // Larger than the other tests' pictures, or edges would be all there is.
    let mut capture = scene.capture.clone();
    capture.cameras[0] = motes_scene::Camera::from_pinhole(camera(scene).resized(240, 180));
    write_capture(&scene.path("capture.json"), &capture).unwrap();
    let folder = scene.folder.path();
    stage(
        EXPORT,
        folder,
        &["--scene", "scene", "--format", "mesh", "--texture-size", "512", "-o", "m.glb", "-w"],
    );
    let name = scene.capture.views[0].name.as_str();
    let line = ["--scene", "scene", "--capture", "capture.json", "--view", name];
    stage(motes_testkit::program("relight"), folder, &[&line[..], &["-o", "relit"]].concat());
    let renderer =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scripts/consumers/blender-render.py");
    let output = Command::new(blender)
        .arg(renderer)
        .args(["m.glb", "m.environment.exr", "capture.json", name, "blender.exr", "24", "0"])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let theirs = open_exr(&scene.path("blender.exr")).unwrap();
    let ours = read_image(&scene.path("relit").join(name)).unwrap();
    let planes = ["R", "G", "B"].map(|c| theirs.channel(c).unwrap().to_f32());
    let data = (0..ours.pixel_count())
        .flat_map(|i| {
            [0, 1, 2].map(|c| (srgb::encode(planes[c][i].clamp(0.0, 1.0)) * 255.0).round() as u8)
        })
        .collect();
    let encoded = ImageU8::from_data(ours.width, ours.height, 3, data);
    write_png(&scene.path("blender.png"), &encoded).unwrap();
    assert_agree(what, &scene.path("blender.png"), &ours.to_f32(), LEAST_RENDERER_DB);
}

/// The scene folder of the toy scene with a mesh composed into it.
fn composed() -> ToyScene {
    let scene = scene_with_photos();
    let cone = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/meshes/cone.ply");
    let asset = serde_json::json!({
        "file": cone, "at": [0.9, 0.5, 0.0], "height": 0.7, "gaussians": 4000, "material": "terracotta",
    });
    let folder = scene.folder.path();
    let line = ["--scene", "scene", "--capture", "capture.json", "--compose", &asset.to_string()];
    stage(motes_testkit::program("edit"), folder, &[&line[..], &["-o", "composed"]].concat());
    std::fs::rename(scene.path("scene"), scene.path("bare")).unwrap();
    std::fs::rename(scene.path("composed"), scene.path("scene")).unwrap();
    let gaussians = |of: &str| read_gaussians(&scene.path(of).join("gaussians.ply")).unwrap().len();
    assert!(gaussians("scene") > gaussians("bare") + 3000);
    scene
}

#[test]
fn what_was_composed_opens_in_a_browser_in_the_validator_and_in_blender() {
    let (Some(browser), Some(_)) = (consumer("chromium"), consumer("node_modules/playwright-core"))
    else {
        return;
    };
    let (Some(_), Some(blender)) =
        (consumer("node_modules/gltf-validator"), consumer("blender/bin/python"))
    else {
        return;
    };
    let scene = composed();
    let (folder, packages) = (scene.folder.path(), browser.parent().unwrap());
    stage(EXPORT, folder, &["--scene", "scene", "--capture", "capture.json", "-o", "page.html"]);
    let view = &scene.capture.views[VIEW];
    let pictures = scene.path("pictures");
    std::fs::create_dir(&pictures).unwrap();
    let files = [scene.path("page.html"), pictures.clone()];
    script(packages, "page-pictures.mjs", &[&files[0], &files[1]], &[&view.name, "appearance"]);
    let gaussians = read_gaussians(&scene.path("scene/gaussians.ply")).unwrap();
    let ours = picture(&gaussians, &scene, view);
    assert_agree("composed", &pictures.join("appearance.png"), &ours, LEAST_DB);
    let mesh = ["--scene", "scene", "--format", "mesh", "--texture-size", "256", "-o", "valid.glb"];
    stage(EXPORT, folder, &mesh);
    script(packages, "validate-gltf.mjs", &[&scene.path("valid.glb")], &[]);
    assert_blender_agrees(&blender, &scene, "composed-blender");
}
