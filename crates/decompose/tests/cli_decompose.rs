//! The stage `decompose` as a program: the scene folder, known lights, exit codes.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Output;

use decompose::pipeline::STEPS;
use glam::Vec3;

use motes_formats::decomposition::read_decomposition;
use motes_formats::environment::{read_environment, write_environment};
use motes_formats::images::{read_image, write_png};
use motes_formats::ply::{read_gaussians, read_surface, write_surface};
use motes_formats::selection::sha256_of_file;
use motes_scene::ScaleAnchor;
use motes_scene::{ImageF32, ImageU8, Materials, Residual, Split, Surface};
use motes_testkit::toy_capture::{ToyCapture, assert_code, run, stderr, toy_capture};

/// A sheet through the middle of the toy's Gaussians that faces the cameras, and a bright even light.
fn prepared() -> ToyCapture {
    let toy = toy_capture();
    let forward = toy.capture.views[0].camera_from_world.inverse().rotation_matrix().z_axis;
    write_surface(&toy.path("sheet.ply"), &sheet(-forward.as_vec3())).unwrap();
    write_environment(&toy.path("light.exr"), &ImageF32::filled(16, 8, 3, 1.0), &[]).unwrap();
    toy
}

fn sheet(normal: Vec3) -> Surface {
    let side = normal.any_orthonormal_vector();
    let across = normal.cross(side);
    let (n, size) = (20u32, 6.0);
    let mut surface = Surface::default();
    for y in 0..=n {
        for x in 0..=n {
            let at = |k: u32| (k as f32 / n as f32 - 0.5) * size;
            surface.vertices.push((side * at(x) + across * at(y)).to_array());
            surface.normals.push(normal.to_array());
        }
    }
    for y in 0..n {
        for x in 0..n {
            let a = y * (n + 1) + x;
            surface.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
        }
    }
    surface
}

fn decompose(toy: &ToyCapture, arguments: &[&str]) -> Output {
    let mut all = vec!["--capture", "capture.json", "--gaussians", "true.ply", "--no-provenance"];
    all.extend(["--samples", "300", "--material-rays", "12", "--pixel-rays", "8"]);
    all.extend(["--color-passes", "2", "--surface", "sheet.ply"]);
    if !arguments.contains(&"--photo-steps") {
        all.extend(["--photo-steps", "10"]);
    }
    all.extend(arguments);
    run(env!("CARGO_BIN_EXE_decompose"), toy.folder.path(), &all)
}

#[test]
fn a_scene_folder_is_written_whole_and_kept() {
    let toy = prepared();
    let before = &toy.gaussians;
    let done = decompose(&toy, &["-o", "scene", "--environment", "light.exr"]);
    assert_code(&done, 0);
    let scene = read_decomposition(&toy.path("scene")).unwrap();
    assert_eq!(scene.document.scale_anchor.kind, ScaleAnchor::Environment);
    assert!(scene.document.terms.iter().any(|t| t.name == "specular"));
    let source = scene.document.source_gaussians.as_ref().unwrap();
    assert_eq!(source.sha256, sha256_of_file(&toy.path("true.ply")).unwrap());
    let gaussians = read_gaussians(&scene.gaussians).unwrap();
    assert_eq!((gaussians.len(), gaussians.sh_degree), (before.len(), before.sh_degree));
    assert_ne!(gaussians.means, before.means, "fitted to the photos once more");
    let residual = Residual::of(&gaussians).unwrap().unwrap();
    assert!(residual.degree == 3 && residual.log_ratio_sh.iter().any(|v| *v != 0.0));
    let term = scene.document.terms.iter().find(|t| t.name == "residual").unwrap();
    assert!(term.numbers["psnr_db"] > term.numbers["psnr_db_without"], "{}", term.evidence);
    let materials = Materials::of(&gaussians).unwrap();
    assert!(materials.base_color_linear.iter().flatten().all(|v| (0.0..=1.0).contains(v)));
    assert!(read_surface(&scene.surface).unwrap().has_materials());
    assert!(toy.path("scene/environment.exr").exists());
    assert!(toy.path("scene/previews/environment.png").exists());
    assert_code(&decompose(&toy, &["-o", "scene", "--environment", "light.exr"]), 2);
    let again = decompose(&toy, &["-o", "again", "--environment", "light.exr", "--threads", "1"]);
    assert_code(&again, 0);
    let bytes = |path: &str| std::fs::read(toy.path(path)).unwrap();
    for file in ["gaussians.ply", "surface.ply", "environment.exr"] {
        assert_eq!(bytes(&format!("scene/{file}")), bytes(&format!("again/{file}")), "{file}");
    }
}

#[test]
fn a_known_light_stands_upright_on_the_ground_that_is_found() {
    let toy = prepared();
    let (sin, cos) = 20.0f32.to_radians().sin_cos();
    let ground = Vec3::new(0.6 * sin, -0.8 * sin, cos);
    write_surface(&toy.path("sheet.ply"), &sheet(ground)).unwrap();
    let mut sky = ImageF32::filled(16, 8, 3, 0.1);
    sky.data[..16 * 4 * 3].fill(1.0);
    write_environment(&toy.path("sky.exr"), &sky, &[]).unwrap();
    let off = ["--photo-steps", "0", "--residual-steps", "0"];
    for (more, upright) in [(&[][..], true), (&["--env-up", "map"], false)] {
        let folder = if upright { "upright" } else { "stored" };
        let light = [&["-o", folder, "--environment", "sky.exr"], more].concat();
        assert_code(&decompose(&toy, &[&light[..], &off[..]].concat()), 0);
        let scene = read_decomposition(&toy.path(folder)).unwrap();
        let up = glam::DVec3::from_array(scene.document.up_in_world);
        assert!(up.distance(ground.as_dvec3()) < 1e-4, "{up}");
        // The map of the folder has its zenith where the surface has its up, whatever the light was.
        let zenith = scene.document.environment_up_in_world.unwrap();
        assert!(up.distance(zenith.into()) < 1e-6);
        let map = read_environment(&scene.environment).unwrap();
        let row = |y: usize| map.pixel(0, y)[0];
        let is_upright = row(0) > 0.99
            && row(map.height - 1) < 0.11
            && (0..map.width).all(|x| {
                map.pixel(x, map.height / 4)[0] > 0.9 && map.pixel(x, 3 * map.height / 4)[0] < 0.2
            });
        assert_eq!(is_upright, upright, "{folder}");
    }
}

#[test]
fn a_preset_sets_what_no_flag_does() {
    let toy = prepared();
    let of = |more: &[&str]| -> serde_json::Value {
        let done = decompose(&toy, &[&["-o", "scene", "--dump-config"], more].concat());
        assert_code(&done, 0);
        serde_json::from_slice(&done.stdout).unwrap()
    };
    let [draft, balanced, high] = ["draft", "balanced", "high"].map(|name| of(&["--preset", name]));
    assert_eq!(of(&[]), balanced, "the default");
    for (key, order) in
        [("residual_steps", [true, false]), ("reflected_light_rounds", [true, false])]
    {
        assert_eq!([draft[key] != balanced[key], high[key] != balanced[key]], order, "{key}");
    }
    // The line of this test gives these.
    for key in ["photo_steps", "material_rays", "pixel_rays", "samples"] {
        assert_eq!(draft[key], balanced[key], "{key}");
    }
    assert_code(&decompose(&toy, &["-o", "scene", "--preset", "best"]), 2);
}

#[test]
fn the_phases_are_named_in_progress() {
    let toy = prepared();
    let line =
        ["-o", "scene", "--environment", "light.exr", "--progress", "json", "--previews", "0"];
    let done = decompose(&toy, &line);
    assert_code(&done, 0);
    let said = stderr(&done);
    let named: Vec<_> = STEPS
        .iter()
        .enumerate()
        .filter(|(i, step)| said.contains(&format!("{}, {} of {}", step.doing, i + 1, STEPS.len())))
        .collect();
    assert!(!named.is_empty(), "{said}");
}

#[test]
fn without_photo_steps_the_standard_columns_are_those_of_the_input() {
    let toy = prepared();
    let off = ["--photo-steps", "0", "--residual-steps", "0"];
    let arguments = [&["-o", "scene", "--environment", "light.exr"], &off[..]].concat();
    assert_code(&decompose(&toy, &arguments), 0);
    let gaussians = read_gaussians(&toy.path("scene/gaussians.ply")).unwrap();
    assert_eq!(Residual::of(&gaussians), Ok(None));
    let plain = motes_scene::Gaussians { extra: Vec::new(), ..gaussians };
    assert_eq!(plain, motes_scene::Gaussians { extra: Vec::new(), ..toy.gaussians.clone() });
}

#[test]
fn without_a_light_the_anchor_is_named() {
    let toy = prepared();
    assert_code(&decompose(&toy, &["-o", "scene"]), 0);
    let kind = read_decomposition(&toy.path("scene")).unwrap().document.scale_anchor.kind;
    assert!(matches!(kind, ScaleAnchor::Specular | ScaleAnchor::Prior), "{kind:?}");
    let view = toy.capture.views.iter().find(|v| v.name != "view_2.png").unwrap().name.clone();
    let anchor = format!("{view},10,10=0.5");
    assert_code(&decompose(&toy, &["-o", "anchored", "--albedo-anchor", &anchor]), 0);
    let kind = read_decomposition(&toy.path("anchored")).unwrap().document.scale_anchor.kind;
    assert_eq!(kind, ScaleAnchor::AlbedoAnchor);
}

#[test]
fn photos_with_an_alpha_channel_are_understood() {
    let toy = prepared();
    let path = toy.path("images/view_1.png");
    let photo = read_image(&path).unwrap();
    // Opaque throughout, then with a hole.
    for (folder, hidden, fills_photos) in [("whole", 0, true), ("open", 9, false)] {
        let alpha = |i: usize| if i < hidden { 0 } else { 255 };
        let pixels = photo.data.chunks_exact(3).enumerate();
        let data = pixels.flat_map(|(i, p)| [p[0], p[1], p[2], alpha(i)]).collect();
        write_png(&path, &ImageU8::from_data(photo.width, photo.height, 4, data)).unwrap();
        assert_code(&decompose(&toy, &["-o", folder, "--environment", "light.exr"]), 0);
        let document = read_decomposition(&toy.path(folder)).unwrap().document;
        assert_eq!(document.fills_photos, Some(fills_photos), "{folder}");
    }
}

#[test]
fn wrong_requests_say_what_is_wrong_and_write_nothing() {
    let toy = prepared();
    std::fs::create_dir(toy.path("small")).unwrap();
    write_png(&toy.path("small/view_1_normal.png"), &ImageU8::filled(2, 2, 3, 128)).unwrap();
    let two = ["--environment", "light.exr", "--environment", "light.exr"];
    for (arguments, code, word) in [
        (&["--albedo-anchor", "nobody.png,1,1=0.5"][..], 2, "nobody.png"),
        (&["--albedo-anchor", "view_1.png,1,1=7"], 2, "0 and at most 1"),
        (&["--environment", "missing.exr"], 3, "missing.exr"),
        (&two[..], 2, "2 lights"),
        (&["--prior-images", "."], 2, "_albedo.png"),
        (&["--prior-images", "small"], 3, "view_1_normal.png"),
    ] {
        let done = decompose(&toy, &[&["-o", "scene"], arguments].concat());
        assert_code(&done, code);
        assert!(stderr(&done).contains(word), "{word}: {}", stderr(&done));
        assert!(!toy.path("scene/decomposition.json").exists());
    }
}

/// Bytes of all files of a folder, by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                open.push(entry);
            } else {
                let name = entry.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                all.insert(name, std::fs::read(&entry).unwrap());
            }
        }
    }
    all
}

const QUICK: [&str; 4] = ["--residual-steps", "5", "--previews", "1"];

#[test]
fn a_run_that_stops_after_every_step_gives_the_bytes_of_one_that_does_not() {
    let toy = prepared();
    assert_code(&decompose(&toy, &[&["-o", "whole"], &QUICK[..]].concat()), 0);
    let steps = STEPS.map(|step| step.name);
    let (last, others) = steps.split_last().unwrap();
    for step in others {
        let arguments = ["--work", "work", "--from", *step, "--until", *step];
        assert_code(&decompose(&toy, &[&arguments, &QUICK[..]].concat()), 0);
    }
    let arguments = ["--work", "work", "--from", *last, "-o", "scene"];
    assert_code(&decompose(&toy, &[&arguments, &QUICK[..]].concat()), 0);
    let (whole, scene) = (files(&toy.path("whole")), files(&toy.path("scene")));
    assert!(whole.len() > 8, "{:?}", whole.keys());
    assert_eq!(whole.keys().collect::<Vec<_>>(), scene.keys().collect::<Vec<_>>());
    for (name, bytes) in &whole {
        assert!(*bytes == scene[name], "{name}");
    }
    // Each step has a folder, and each folder says what it is.
    let document = std::fs::read_to_string(toy.path("work/03-light/step.json")).unwrap();
    assert!(document.contains("\"motes/decompose-step\"") && document.contains("\"light\""));
}

#[test]
fn as_many_held_out_photos_are_looked_at_as_asked_and_a_work_folder_keeps_to_them() {
    let toy = prepared();
    let one = ["--most-held-out", "1", "--work", "work", "--until", "shading"];
    assert_code(&decompose(&toy, &[&one, &QUICK[..]].concat()), 0);
    let held_out = |most: &str| {
        let arguments =
            ["--work", "work", "--from", "base-color", "-o", "scene", "-w", "--most-held-out"];
        let done = decompose(&toy, &[&arguments[..], &[most], &QUICK[..]].concat());
        (done.status.code(), stderr(&done))
    };
    let (code, said) = held_out("0");
    assert!(code == Some(3) && said.contains("give --most-held-out as then"), "{said}");
    let (code, said) = held_out("1");
    assert!(code == Some(0) && said.contains("(held-out photos: 1)"), "{said}");
    let views = read_decomposition(&toy.path("scene")).unwrap().document.views;
    let names: Vec<&str> =
        views.iter().filter(|v| v.split == Split::Test).map(|v| v.name.as_str()).collect();
    assert_eq!(names, [toy.capture.views[5].name.as_str()], "of the third and the sixth");
}

#[test]
fn what_another_program_put_in_place_of_a_step_is_gone_on_from() {
    let toy = prepared();
    let until = ["--work", "work", "--until", "light"];
    let done = decompose(&toy, &until);
    assert_code(&done, 0);
    let said = String::from_utf8_lossy(&[&done.stdout[..], &done.stderr].concat()).into_owned();
    assert!(said.contains("--from materials"), "{said}");
    let go_on = |to: &str| {
        let arguments = ["--work", "work", "--from", "materials", "-o", to, "-w"];
        decompose(&toy, &[&arguments, &QUICK[..]].concat())
    };
    assert_code(&go_on("plain"), 0);
    // Blue light, as another program might have found it.
    let path = toy.path("work/03-light/light.json");
    let mut light: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    for cell in light["radiance"][0].as_array_mut().unwrap() {
        *cell = serde_json::json!([0.1, 0.1, 0.9]);
    }
    std::fs::write(&path, light.to_string()).unwrap();
    assert_code(&go_on("blue"), 0);
    let mean = |scene: &str| {
        let surface = read_surface(&toy.path(scene).join("surface.ply")).unwrap();
        let sum =
            surface.base_color_linear.iter().fold([0.0; 2], |s, b| [s[0] + b[0], s[1] + b[2]]);
        sum[0] / sum[1]
    };
    assert!(mean("blue") > 2.0 * mean("plain"), "{} {}", mean("blue"), mean("plain"));
    // Not a light at all.
    light["radiance"] = serde_json::json!([[[1.0, 1.0, 1.0]]]);
    std::fs::write(&path, light.to_string()).unwrap();
    let done = go_on("none");
    assert_code(&done, 3);
    assert!(stderr(&done).contains("light.json"), "{}", stderr(&done));
}

#[test]
fn a_work_folder_that_does_not_fit_is_refused_and_kept() {
    let toy = prepared();
    let until = |step| decompose(&toy, &["--work", "work", "--until", step]);
    assert_code(&until("materials"), 0);
    let before = files(&toy.path("work"));
    std::fs::copy(toy.path("true.ply"), toy.path("other.ply")).unwrap();
    let mut bytes = std::fs::read(toy.path("other.ply")).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    std::fs::write(toy.path("other.ply"), bytes).unwrap();
    let went_on = ["--work", "work", "--from", "reflected-light", "-o", "scene"];
    for (arguments, code, word) in [
        (&["--until", "light"][..], 2, "--work"),
        (&["--work", "work", "--until", "nothing"], 2, "surface"),
        (&["--work", "work", "--until", "light", "-o", "scene"], 2, "--output"),
        (&["--work", "work", "--from", "light", "--until", "samples"], 2, "comes after"),
        (&["--work", "work", "--until", "light"], 2, "exists already"),
        (&["--work", "work", "--from", "light", "-o", "scene"], 2, "exists already"),
        (&["--work", "work", "--from", "shading", "-o", "scene"], 3, "no such step"),
        (&["--work", "none", "--from", "light", "-o", "scene"], 3, "no such step"),
        (&[&went_on[..], &["--most-photos", "3"]].concat(), 3, "photos, not 3"),
    ] {
        let done = decompose(&toy, arguments);
        assert_code(&done, code);
        assert!(stderr(&done).contains(word), "{word}: {}", stderr(&done));
    }
    let other = ["--capture", "capture.json", "--gaussians", "other.ply", "--surface", "sheet.ply"];
    let all = [&other[..], &went_on, &["--no-provenance"]].concat();
    let done = run(env!("CARGO_BIN_EXE_decompose"), toy.folder.path(), &all);
    assert_code(&done, 3);
    assert!(stderr(&done).contains("another file as --gaussians"), "{}", stderr(&done));
    assert!(before == files(&toy.path("work")), "nothing in the work folder was touched");
    // A step that was run again takes what rested on it away.
    assert_code(
        &decompose(&toy, &["--work", "work", "--from", "light", "--until", "light", "-w"]),
        0,
    );
    assert!(!toy.path("work/04-materials").exists() && toy.path("work/03-light").exists());
}
