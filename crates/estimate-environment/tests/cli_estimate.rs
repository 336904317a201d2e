//! The program: sources, products, refusals.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::Path;
use std::process::{Command, Output};

use motes_formats::environment::{read_environment, write_environment};
use motes_formats::images::write_png;
use motes_math::srgb;
use motes_scene::{ImageF32, ImageU8};
use motes_testkit::toy_scene::toy_scene;
use serde_json::Value;

fn run(folder: &Path, line: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_estimate-environment"));
    command.args(line).args(["--no-provenance", "--json", "-q", "-w"]);
    command.current_dir(folder).output().unwrap()
}

#[track_caller]
fn report(done: &Output) -> Value {
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).unwrap()
}

/// A panorama with a window of 40 in a room of 0.1 to 0.3, as photos of `stops`.
fn panorama(folder: &Path, stops: f32, name: &str) {
    let mut image = ImageF32::filled(128, 64, 3, 0.0);
    for y in 0..64 {
        for x in 0..128 {
            let inside = (30..40).contains(&x) && (14..24).contains(&y);
            let v = if inside { 40.0 } else { 0.1 + 0.2 * x as f32 / 128.0 };
            image.pixel_mut(x, y).fill(srgb::encode((v * stops.exp2()).min(1.0)));
        }
    }
    write_png(&folder.join(name), &image.to_u8()).unwrap();
}

#[test]
fn a_series_of_panoramas_keeps_what_one_picture_clips() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("series")).unwrap();
    for (i, stops) in [-6.0, -3.0, 0.0].into_iter().enumerate() {
        panorama(&dir.path().join("series"), stops, &format!("{i}.png"));
    }
    let line = ["--brackets", "series", "--rows", "32", "-o", "light.exr", "--preview", "p.png"];
    let refused = run(dir.path(), &line);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(3) && said.contains("--exposure-times"), "{said}");
    let times = ["--exposure-times", "1/64,1/8,1"];
    let found = report(&run(dir.path(), &[&line[..], &times].concat()));
    let map = read_environment(&dir.path().join("light.exr")).unwrap();
    assert_eq!((map.width, map.height), (64, 32));
    // Window over room, which one unit does not change: 40 over 0.155.
    let ratio = map.pixel(17, 9)[1] / map.pixel(17, 28)[1];
    assert!((ratio / (40.0 / 0.155) - 1.0).abs() < 0.25, "{ratio}");
    assert!(found["clipped_share"].as_f64().unwrap() < 1e-6, "{found}");
    assert!(dir.path().join("p.png").is_file());
    let wrong = run(dir.path(), &[&line[..], &["--exposure-times", "1,2"]].concat());
    assert_eq!(wrong.status.code(), Some(2));
}

#[test]
fn a_ball_is_found_and_reported() {
    let dir = tempfile::tempdir().unwrap();
    let mut image = ImageU8::filled(200, 160, 3, 30);
    for y in 0..160 {
        for x in 0..200 {
            let (dx, dy) = ((x as f64 + 0.5 - 110.0) / 60.0, (y as f64 + 0.5 - 82.0) / 60.0);
            if dx.hypot(dy) < 1.0 {
                let v = (150.0 + 60.0 * dx - 40.0 * dy) as u8;
                image.pixel_mut(x, y).copy_from_slice(&[v, v, 200]);
            }
        }
    }
    write_png(&dir.path().join("ball.png"), &image).unwrap();
    let line = ["--mirror-ball", "ball.png", "--rows", "64", "-o", "light.exr"];
    let found = report(&run(dir.path(), &line));
    let of = |key: &str| found["ball"][key].clone();
    assert!((of("radius").as_f64().unwrap() - 60.0).abs() < 1.5, "{found}");
    assert!((of("center")[0].as_f64().unwrap() - 110.0).abs() < 1.5, "{found}");
    assert!(found["coverage"].as_f64().unwrap() > 0.85, "{found}");
    let map = read_environment(&dir.path().join("light.exr")).unwrap();
    assert!(map.data.iter().all(|v| v.is_finite() && *v > 0.0));
    // Half the reflectance, twice the light.
    let half = [&line[..], &["--ball-reflectance", "0.5", "--ball", "110,82,60"]].concat();
    let twice = report(&run(dir.path(), &half));
    let mean = |report: &Value| report["mean_radiance"][0].as_f64().unwrap();
    assert!((mean(&twice) / mean(&found) - 2.0).abs() < 0.1, "{twice} {found}");
}

#[test]
fn a_scene_and_a_splat_give_the_light_of_their_place() {
    let toy = toy_scene();
    let folder = toy.folder.path();
    let own = report(&run(folder, &["--scene", "scene", "--rows", "32", "-o", "own.exr"]));
    assert!(own["mean_radiance"][1].as_f64().unwrap() > 0.0, "{own}");
    let at = ["--scene", "scene", "--at", "0.7,0.7,0.3", "--rows", "32", "-o", "at.exr"];
    report(&run(folder, &at));
    let [own, at] = ["own.exr", "at.exr"].map(|f| read_environment(&toy.path(f)).unwrap());
    // Above is the same light, below is the floor.
    let row = |map: &ImageF32, y: usize| (0..64).map(|x| map.pixel(x, y)[1]).sum::<f32>() / 64.0;
    assert!((row(&own, 2) / row(&at, 2) - 1.0).abs() < 0.2, "{} {}", row(&own, 2), row(&at, 2));
    assert!((row(&own, 30) - row(&at, 30)).abs() > 1e-3);
    let line = ["--gaussians", "scene/gaussians.ply", "--capture", "capture.json"];
    let place = ["--at", "0.7,0.7,0.3", "--rows", "32", "-o", "place.exr"];
    let found = report(&run(folder, &[&line[..], &place].concat()));
    assert!(found["place"]["evidence_points"].as_u64().unwrap() > 100, "{found}");
    assert!((0.1..0.95).contains(&found["coverage"].as_f64().unwrap()), "{found}");
    let map = read_environment(&toy.path("place.exr")).unwrap();
    assert!(map.data.iter().all(|v| v.is_finite() && *v >= 0.0));
    let threads = [&line[..], &place[..], &["-j", "1"]].concat();
    report(&run(folder, &threads));
    assert_eq!(map, read_environment(&toy.path("place.exr")).unwrap(), "at any thread count");
}

#[test]
fn mistakes_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let image = ImageF32::filled(30, 20, 3, 0.4);
    write_environment(&dir.path().join("odd.exr"), &image, &[]).unwrap();
    write_png(&dir.path().join("gray.png"), &ImageU8::filled(90, 90, 3, 90)).unwrap();
    for (line, code, says) in [
        (&[][..], 2, "required"),
        (&["--brackets", "none"], 3, "no such file"),
        (&["--brackets", "odd.exr"], 3, "twice as wide as high"),
        (&["--mirror-ball", "gray.png"], 3, "--ball CX,CY,R"),
        (&["--mirror-ball", "gray.png", "--ball", "500,9,9"], 3, "does not lie"),
        (&["--mirror-ball", "gray.png", "--ball", "1,2"], 2, "CX,CY,R"),
        (&["--gaussians", "g.ply", "--at", "0,0,0"], 2, "--capture"),
        (&["--picture", "gray.png"], 2, "--provider"),
        (&["--mirror-ball", "gray.png", "--at", "0,0,0"], 2, "cannot be used"),
    ] {
        let done = run(dir.path(), &[line, &["-o", "light.exr"]].concat());
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.code() == Some(code) && said.contains(says), "{line:?}: {said}");
    }
}
