//! `--compose`: size, contact, light and shadow of what is put in.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

mod box_on_ground;

use std::process::{Command, Output};

use box_on_ground::{BOX, ORANGE, add_square, environment, error, photographed};
use edit::compose::{LightAt, LocalLight, cast_shadow, ground_patch, lit_asset};
use glam::{DVec3, Vec3};
use motes_scene::{Gaussians, Materials, Surface};
use motes_shading::environment::{Convention, MapAxes};
use motes_testkit::toy_scene::{ToyScene, toy_scene};
use serde_json::Value;

/// The box of the fixture alone, standing at the origin.
fn lone_box() -> (Gaussians, Surface) {
    let mut scene = (Gaussians::empty(0), Materials::default(), Surface::default());
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * 2.0 * BOX);
    let low = Vec3::new(-BOX, -BOX, 0.0);
    for sides in
        [[low + z, x, y], [low, x, z], [low + x, y, z], [low + x + y, -x, z], [low + y, -y, z]]
    {
        add_square(&mut scene, sides, 10, ORANGE);
    }
    let (mut gaussians, materials, surface) = scene;
    materials.attach(&mut gaussians);
    (gaussians, surface)
}

#[test]
fn a_shadow_on_a_plain_splat_is_that_of_the_composed_scene() {
    let (truth, _) = photographed(&[[0.0, 0.0]], true);
    let (bare, _) = photographed(&[], true);
    let (asset, surface) = lone_box();
    let axes = MapAxes::of_world(Convention::Blender);
    let light = LocalLight::new(&environment(), axes, DVec3::Z).unwrap();
    assert!(light.lamp.is_some() && light.to_lamp.z > 0.5, "{}", light.to_lamp);
    let place = LightAt { base: DVec3::ZERO, up: DVec3::Z };
    let mut composed = bare.clone();
    let numbers =
        cast_shadow(&mut composed, &place, &surface, &light, None, (2.0, 0.1), 3).unwrap();
    assert!(numbers.changed > 100 && numbers.deepest < 0.5, "{numbers:?}");
    // Beside the box, which hides what is under it.
    let beside = |p: [f32; 2]| p[0].abs().max(p[1].abs()) > 1.2 * BOX;
    let (with, without) = (error(&composed, &truth, beside), error(&bare, &truth, beside));
    assert!(with < 0.35 * without, "{with} {without}");

    // The asset has the colors that it has in the scene.
    let mut surface = surface;
    let patch = ground_patch(&place, 1.0, Vec3::splat(0.3), &light);
    let first = surface.vertices.len() as u32;
    surface.vertices.extend(patch.vertices);
    surface.normals.extend(patch.normals);
    surface.base_color_linear.extend(patch.base_color_linear);
    surface.roughness.extend(patch.roughness);
    surface.metallic.extend(patch.metallic);
    surface.triangles.extend(patch.triangles.iter().map(|t| t.map(|v| v + first)));
    let all = light.with_lamp(1.0).unwrap();
    let lit = lit_asset(&asset, &surface, DVec3::Z, &all, 3).unwrap();
    let top = |g: &Gaussians| -> f32 {
        let rows = (0..g.len()).filter(|i| (g.means[*i][2] - 2.0 * BOX).abs() < 1e-3);
        let colors: Vec<f32> = rows.map(|i| 0.5 + 0.282_094_8 * g.sh_of(i)[0]).collect();
        colors.iter().sum::<f32>() / colors.len() as f32
    };
    assert!((top(&lit) - top(&truth)).abs() < 0.04, "{} {}", top(&lit), top(&truth));
    let dark = light.with_lamp(0.0).unwrap();
    let shaded = lit_asset(&asset, &surface, DVec3::Z, &dark, 3).unwrap();
    assert!(top(&shaded) < 0.8 * top(&lit), "{} {}", top(&shaded), top(&lit));
}

fn edit(toy: &ToyScene, line: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_edit"));
    command.args(line).args(["--no-provenance", "--json", "-q", "-w"]);
    command.current_dir(toy.folder.path()).output().unwrap()
}

#[track_caller]
fn numbers(done: &Output) -> Value {
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let said: Value = serde_json::from_slice(&done.stdout).unwrap();
    said["applied"][0]["numbers"].clone()
}

/// A block of 1 by 2 by 1, y up.
const BLOCK: &str = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 2 0\nv 1 2 0\nv 1 2 1\nv 0 2 1\n\
    f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";

#[test]
fn sizes_in_meters_and_contact_are_in_the_answer() {
    let toy = toy_scene();
    std::fs::write(toy.path("block.obj"), BLOCK).unwrap();
    let compose = |keys: &str| {
        let op = format!("{{\"file\": \"block.obj\", \"at\": [0.6, 0.6, 0.02], {keys}}}");
        let line = ["--scene", "scene", "--capture", "capture.json", "--reshade-samples", "4"];
        numbers(&edit(&toy, &[&line[..], &["--compose", &op, "-o", "out"]].concat()))
    };
    let found = compose("\"height_m\": 0.5, \"meters_per_unit\": 2.0");
    let of = |found: &Value, key: &str| found[key].as_f64().unwrap();
    assert!((of(&found, "height") - 0.25).abs() < 1e-3, "{found}");
    assert!((of(&found, "height_m") - 0.5).abs() < 2e-3 && of(&found, "meters_per_unit") == 2.0);
    assert!(of(&found, "gap_before") > 0.01 && of(&found, "gap").abs() < 1e-4, "{found}");
    // A length of 1 that is 4 meters; without a height the block is 2 of its own meters tall.
    let length = "\"known_length\": {\"from\": [0,0,0], \"to\": [0,1,0], \"meters\": 4}";
    let found = compose(length);
    assert!((of(&found, "height") - 0.5).abs() < 1e-3, "{found}");
    let found = compose("\"height\": 0.3, \"touch\": false");
    assert!(of(&found, "gap") == of(&found, "gap_before"), "{found}");
    assert!(of(&compose("\"camera_height_m\": 1.6"), "meters_per_unit") > 0.0);
}

#[test]
fn mistakes_of_composing_are_named() {
    let toy = toy_scene();
    std::fs::write(toy.path("block.obj"), BLOCK).unwrap();
    for (keys, more, says) in [
        ("\"height_m\": 1", &["--scene", "scene"][..], "the length of a unit"),
        (
            "\"height\": 1, \"height_m\": 1, \"meters_per_unit\": 1",
            &["--scene", "scene"],
            "exclude",
        ),
        ("\"meters_per_unit\": 1, \"camera_height_m\": 1", &["--scene", "scene"], "is enough"),
        ("\"camera_height_m\": 1", &["--scene", "scene"], "nothing about the size"),
        ("\"height\": 0.2", &["--gaussians", "scene/gaussians.ply"], "give --capture"),
    ] {
        let op = format!("{{\"file\": \"block.obj\", \"at\": [0.6, 0.6, 0], {keys}}}");
        let output = if more[0] == "--scene" { "out" } else { "out.ply" };
        let done = edit(&toy, &[more, &["--compose", &op, "-o", output]].concat());
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.code() == Some(3) && said.contains(says), "{keys}: {said}");
    }
}

#[test]
fn a_plain_splat_gets_light_and_shadow_from_its_views() {
    let toy = toy_scene();
    std::fs::write(toy.path("block.obj"), BLOCK).unwrap();
    let line = ["--gaussians", "scene/gaussians.ply", "--capture", "capture.json"];
    let op = ["--compose", "block.obj", "--at", "0.6,0.6,0", "--height", "0.25", "-o", "out.ply"];
    let found = numbers(&edit(&toy, &[&line[..], &op].concat()));
    assert!(found["light_coverage"].as_f64().unwrap() > 0.1, "{found}");
    assert!(found["shadowed"].as_f64().unwrap() > 5.0, "{found}");
    assert!(found["deepest_shadow"].as_f64().unwrap() < 0.9, "{found}");
}

/// A level square of many more triangles than the toy scene has, as OBJ.
fn fine_tile() -> String {
    const CELLS: usize = 130;
    let mut text = String::new();
    for j in 0..=CELLS {
        for i in 0..=CELLS {
            let at = |k: usize| k as f64 / CELLS as f64 - 0.5;
            text += &format!("v {} {} {}\n", at(i), 0.02 * at(i).cos(), at(j));
        }
    }
    for j in 0..CELLS {
        for i in 0..CELLS {
            let a = 1 + j * (CELLS + 1) + i;
            text += &format!("f {} {} {} {}\n", a, a + CELLS + 1, a + CELLS + 2, a + 1);
        }
    }
    text
}

#[test]
fn a_fine_mesh_leaves_what_is_far_from_it_as_it_was() {
    let toy = toy_scene();
    let file = toy.path("scene/gaussians.ply");
    // Gaussians of a fit lie below the surface as often as above: by less than the surface of a Gaussian is looked for.
    let mut before = motes_formats::ply::read_gaussians(&file).unwrap();
    let below = 0.03;
    before.means.iter_mut().for_each(|mean| mean[2] -= below);
    let options = motes_formats::ply::PlyWriteOptions::default();
    motes_formats::ply::write_gaussians(&file, &before, &options).unwrap();
    std::fs::write(toy.path("tile.obj"), fine_tile()).unwrap();
    let op =
        "{\"file\": \"tile.obj\", \"at\": [1.2, 1.2, 0], \"height\": 0.0004, \"gaussians\": 500}";
    let done = edit(&toy, &["--scene", "scene", "--compose", op, "-o", "out"]);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    let after = motes_formats::ply::read_gaussians(&toy.path("out/gaussians.ply")).unwrap();
    let k = 3 * before.sh_coefficients();
    let far = (0..before.len()).filter(|&i| {
        let [x, y, _] = before.means[i];
        (x - 1.2).hypot(y - 1.2) > 1.0
    });
    let shown = |of: &Gaussians, i: usize| 0.5 + 0.282_094_8 * of.sh[k * i + 1];
    let changed = far.clone().filter(|&i| (shown(&after, i) - shown(&before, i)).abs() > 0.02);
    let (changed, all) = (changed.count(), far.count());
    assert!(all > 500 && changed * 50 < all, "{changed} of {all} far Gaussians changed");
}
