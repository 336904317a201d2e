//! The stage `decompose` as a program: the scene folder, known lights, exit codes.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::process::Output;

use motes_formats::decomposition::{ScaleAnchorKind, read_decomposition};
use motes_formats::environment::write_environment;
use motes_formats::images::{read_image, write_png};
use motes_formats::ply::{read_gaussians, read_surface, write_surface};
use motes_formats::selection::sha256_of_file;
use motes_scene::{ImageF32, ImageU8, Materials, Residual, Surface};
use motes_testkit::toy_capture::{ToyCapture, assert_code, run, stderr, toy_capture};

/// A sheet through the middle of the toy's Gaussians, and a bright even light.
fn prepared() -> ToyCapture {
    let toy = toy_capture();
    let forward = toy.capture.views[0].camera_from_world.inverse().rotation_matrix().z_axis;
    let normal = -forward.as_vec3();
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
    write_surface(&toy.path("sheet.ply"), &surface).unwrap();
    write_environment(&toy.path("light.exr"), &ImageF32::filled(16, 8, 3, 1.0), &[]).unwrap();
    toy
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
    assert_eq!(scene.document.scale_anchor.kind, ScaleAnchorKind::Environment);
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
    assert!(matches!(kind, ScaleAnchorKind::Specular | ScaleAnchorKind::Prior), "{kind:?}");
    let view = toy.capture.views.iter().find(|v| v.name != "view_2.png").unwrap().name.clone();
    let anchor = format!("{view},10,10=0.5");
    assert_code(&decompose(&toy, &["-o", "anchored", "--albedo-anchor", &anchor]), 0);
    let kind = read_decomposition(&toy.path("anchored")).unwrap().document.scale_anchor.kind;
    assert_eq!(kind, ScaleAnchorKind::AlbedoAnchor);
}

#[test]
fn photos_with_an_alpha_channel_are_understood() {
    let toy = prepared();
    let path = toy.path("images/view_1.png");
    let photo = read_image(&path).unwrap();
    let data = photo.data.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
    write_png(&path, &ImageU8::from_data(photo.width, photo.height, 4, data)).unwrap();
    assert_code(&decompose(&toy, &["-o", "scene", "--environment", "light.exr"]), 0);
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
