//! Environment maps over worlds with other axes: up is up, and the picture of the manual shows it.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::{DQuat, DVec3};
use motes_formats::camera_path::{CameraPathDocument, write_camera_path};
use motes_formats::decomposition::read_decomposition;
use motes_formats::environment::{read_environment, write_environment};
use motes_formats::images::{read_image, write_png};
use motes_scene::{ImageU8, Pinhole, Pose};
use motes_shading::environment::{Convention, Orientation, axis_test_map};
use motes_testkit::toy_scene::{ToyScene, turned_pose, turned_toy_scene};

const CONVENTIONS: [(&str, Convention); 3] = [
    ("openexr", Convention::OpenExr),
    ("blender", Convention::Blender),
    ("threejs", Convention::ThreeJs),
];

/// A camera's world: x right, y down, as structure from motion makes it.
fn y_down() -> DQuat {
    DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2)
}

/// Runs `relight` in the folder of the scene and gives back what it said.
#[track_caller]
fn relight(toy: &ToyScene, arguments: &[&str]) -> String {
    let done = Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(["--no-provenance", "--quality", "preview"])
        .args(if arguments.contains(&"--scene") { &[][..] } else { &["--scene", "scene"] })
        .args(arguments)
        .current_dir(toy.folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(0), "{said}");
    said
}

/// A path of one picture past the box toward `ahead` of the toy.
fn write_path(toy: &ToyScene, name: &str, ahead: DVec3, size: (u32, u32), world: DQuat) {
    let (width, height) = size;
    let focal = f64::from(height) * 0.6;
    let camera = Pinhole {
        fx: focal,
        fy: focal,
        cx: f64::from(width) / 2.0,
        cy: f64::from(height) / 2.0,
        width: width as usize,
        height: height as usize,
    };
    let eye = DVec3::new(0.0, -1.7, 0.9);
    let up = if ahead.z.abs() > 0.9 { DVec3::Y } else { DVec3::Z };
    let pose = turned_pose(&Pose::look_at(eye, eye + ahead, up).unwrap(), world);
    write_camera_path(&toy.path(name), &CameraPathDocument::new(&camera, 1.0, &[pose])).unwrap();
}

fn picture(toy: &ToyScene, path: &str, arguments: &[&str]) -> ImageU8 {
    relight(toy, &[&["--path", path, "-o", "out", "-w"], arguments].concat());
    let files: Vec<PathBuf> =
        toy.path("out").read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(files.len(), 1);
    read_image(&files[0]).unwrap()
}

fn axis_map(toy: &ToyScene, convention: Convention) {
    let map = axis_test_map(64, &Orientation::new(convention));
    write_environment(&toy.path("axes.exr"), &map, &[]).unwrap();
}

/// Which channels are bright 14 degrees off `ahead` of the toy: in the disc of an axis, above what stands on the floor.
fn seen(toy: &ToyScene, ahead: DVec3, world: DQuat, light: &[&str]) -> [bool; 3] {
    write_path(toy, "look.json", ahead, (33, 33), world);
    let image = picture(toy, "look.json", light);
    let p = image.pixel(16, 11);
    [p[0] > 200, p[1] > 200, p[2] > 200]
}

#[test]
fn the_zenith_of_every_map_is_over_the_ground() {
    for world in [DQuat::IDENTITY, y_down()] {
        let toy = turned_toy_scene(world);
        for (name, convention) in CONVENTIONS {
            axis_map(&toy, convention);
            let light = ["--environment", "axes.exr", "--env-convention", name];
            // +y is green, +z blue.
            let up = if convention == Convention::Blender {
                [false, false, true]
            } else {
                [false, true, false]
            };
            assert_eq!(seen(&toy, DVec3::Z, world, &light), up, "{name} {world}");
            // The x axis stays x in both worlds, red; turned a quarter to the left it is the toy's +y.
            let ahead = seen(&toy, DVec3::X, world, &light);
            assert_eq!(ahead, [true, false, false], "{name} {world}");
            let turned = [&light[..], &["--env-heading", "90"]].concat();
            assert_eq!(seen(&toy, DVec3::Y, world, &turned), [true, false, false], "{name}");
        }
    }
}

#[test]
fn another_up_is_taken_at_its_word_and_an_upside_down_map_is_warned_of() {
    let world = y_down();
    let toy = turned_toy_scene(world);
    axis_map(&toy, Convention::OpenExr);
    let light = ["--environment", "axes.exr"];
    // As stored: +y of the map is +y of the world, which is down.
    let stored = [&light[..], &["--env-up", "map"]].concat();
    assert_eq!(seen(&toy, DVec3::Z, world, &stored), [true, false, true], "magenta is -y");
    let down = [&light[..], &["--env-up", "y"]].concat();
    assert_eq!(seen(&toy, DVec3::Z, world, &down), [true, false, true]);
    let said = relight(&toy, &[&stored[..], &["-o", "stored.ply"]].concat());
    assert!(said.contains("from below the ground") && said.contains("--env-up"), "{said}");
    let said = relight(&toy, &[&light[..], &["-o", "upright.ply"]].concat());
    assert!(!said.contains("below the ground"), "{said}");
}

#[test]
fn a_scene_folder_remembers_where_its_light_has_its_zenith() {
    let world = y_down();
    let toy = turned_toy_scene(world);
    axis_map(&toy, Convention::OpenExr);
    relight(&toy, &["--environment", "axes.exr", "--as", "scene", "-o", "relit"]);
    let document = read_decomposition(&toy.path("relit")).unwrap().document;
    assert_eq!(document.environment_up_in_world, Some([0.0, -1.0, 0.0]));
    let own = seen(&toy, DVec3::Z, world, &["--scene", "relit"]);
    assert_eq!(own, [false, true, false]);
    // The file is a map like any other: given to the same scene it is the same light.
    let map = read_environment(&toy.path("relit/environment.exr")).unwrap();
    assert_eq!(map, read_environment(&toy.path("axes.exr")).unwrap());
}

#[test]
fn the_picture_of_the_manual_is_what_the_program_makes() {
    let (width, height) = (160, 100);
    let mut sheet = ImageU8::filled(3 * width, 2 * height, 3, 0);
    for (row, world) in [DQuat::IDENTITY, y_down()].into_iter().enumerate() {
        let toy = turned_toy_scene(world);
        write_path(&toy, "view.json", DVec3::new(0.55, 0.8, 0.12), (160, 100), world);
        for (column, (name, convention)) in CONVENTIONS.into_iter().enumerate() {
            axis_map(&toy, convention);
            let light =
                ["--environment", "axes.exr", "--env-convention", name, "--env-exposure", "2"];
            let image = picture(&toy, "view.json", &light);
            for y in 0..height {
                for x in 0..width {
                    sheet
                        .pixel_mut(column * width + x, row * height + y)
                        .copy_from_slice(image.pixel(x, y));
                }
            }
        }
    }
    // To renew the picture, copy this file.
    write_png(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("environment-axes.png"), &sheet)
        .unwrap();
    let manual =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/images/environment-axes.png");
    let shown = read_image(&manual).unwrap();
    assert_eq!((shown.width, shown.height), (sheet.width, sheet.height));
    let off =
        sheet.data.iter().zip(&shown.data).map(|(a, b)| u64::from(a.abs_diff(*b))).sum::<u64>();
    assert!(off < sheet.data.len() as u64, "the picture of the manual is another: {off}");
}
