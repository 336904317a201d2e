//! The stage `relight` as a program: lights, products, extremes, exit codes.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

mod baked;
mod caution;
mod lamps;
mod residual;
mod sky;
mod turntable;

use std::process::{Command, Output};

use glam::DVec3;
use motes_formats::decomposition::read_decomposition;
use motes_formats::exr_aov::open_exr;
use motes_formats::images::read_image;
use motes_formats::ply::{PlyWriteOptions, read_gaussians, write_gaussians};
use motes_scene::ImageU8;
use motes_testkit::toy_scene::{BOX, FLOOR, ToyScene, encode, toy_scene};

/// Linear value of an 8-bit one.
fn decode(value: f32) -> f32 {
    motes_math::srgb::decode(value / 255.0)
}

fn run_program(program: &str, toy: &ToyScene, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).current_dir(toy.folder.path()).output().unwrap()
}

fn relight(toy: &ToyScene, arguments: &[&str]) -> Output {
    let mut all = vec!["--scene", "scene", "--no-provenance"];
    all.extend(arguments);
    run_program(env!("CARGO_BIN_EXE_relight"), toy, &all)
}

fn text(done: &Output) -> String {
    String::from_utf8_lossy(&done.stderr).into_owned()
}

#[track_caller]
fn assert_code(done: &Output, code: i32) {
    assert_eq!(done.status.code(), Some(code), "{}", text(done));
}

const VIEW: [&str; 4] = ["--capture", "capture.json", "--view", "view_0.png"];

/// Relights view 0 into `folder` and reads the picture.
#[track_caller]
fn picture(toy: &ToyScene, folder: &str, arguments: &[&str]) -> ImageU8 {
    let done = relight(toy, &[&VIEW[..], arguments, &["-o", folder]].concat());
    assert_code(&done, 0);
    read_image(&toy.path(folder).join("view_0.png")).unwrap()
}

/// The pixel of view 0 that shows a point.
fn pixel_of(toy: &ToyScene, point: DVec3) -> (usize, usize) {
    let p = toy.capture.views[0].camera_from_world.transform_point(point);
    let camera = toy.capture.cameras[0].as_pinhole().unwrap();
    let at = |f: f64, v: f64, c: f64| (f * v / p.z + c) as usize;
    (at(camera.fx, p.x, camera.cx), at(camera.fy, p.y, camera.cy))
}

fn at(toy: &ToyScene, image: &ImageU8, point: [f64; 3]) -> [f32; 3] {
    let (x, y) = pixel_of(toy, DVec3::from_array(point));
    let p = image.pixel(x, y);
    [p[0], p[1], p[2]].map(f32::from)
}

#[track_caller]
fn assert_near(got: [f32; 3], linear: [f32; 3], within: f32) {
    for (g, l) in got.into_iter().zip(linear) {
        assert!((g - encode(l)).abs() <= within, "{got:?} is not {linear:?}");
    }
}

#[test]
fn an_even_light_shows_base_color_times_radiance() {
    let toy = toy_scene();
    toy.map("even.exr", 8, 4, |_, _| [0.8, 0.6, 0.4]);
    for quality in ["preview", "standard", "reference"] {
        let even = ["--environment", "even.exr", "--env-exposure", "0.5", "--quality", quality];
        let image = picture(&toy, quality, &even);
        // The top of the box sees the whole sky.
        let [r, g, b] = BOX;
        assert_near(at(&toy, &image, [0.0, 0.0, 0.6]), [0.4 * r, 0.3 * g, 0.2 * b], 2.5);
        // So does the floor far from the box, but for a few percent.
        let [r, g, b] = FLOOR;
        assert_near(at(&toy, &image, [-1.4, 0.9, 0.0]), [0.4 * r, 0.3 * g, 0.2 * b], 6.0);
        // By the box it does not.
        let far = at(&toy, &image, [-1.4, 0.9, 0.0])[0];
        assert!(at(&toy, &image, [0.45, 0.0, 0.0])[0] < far - 8.0);
    }
}

#[test]
fn the_scenes_own_light_is_the_default() {
    let toy = toy_scene();
    let image = picture(&toy, "own", &[]);
    assert_near(at(&toy, &image, [0.0, 0.0, 0.6]), BOX.map(|c| 0.5 * c), 2.5);
}

#[test]
fn shadows_move_with_the_sun() {
    let toy = toy_scene();
    let (left, right) = ([0.2, -0.8, 0.0], [0.2, 0.8, 0.0]);
    for (azimuth, lit, dark) in [(90, right, left), (-90, left, right)] {
        let sun = format!("azimuth={azimuth},elevation=30");
        let image = picture(&toy, &format!("sun{azimuth}"), &["--sun", &sun]);
        let (lit, dark) = (at(&toy, &image, lit), at(&toy, &image, dark));
        assert!(lit[1] > 100.0 && dark[1] < 10.0, "{azimuth}: {lit:?} {dark:?}");
        // Turning the light is turning the sun.
        let turned = format!("azimuth={},elevation=30", azimuth - 50);
        let folder = format!("turned{azimuth}");
        let again = picture(&toy, &folder, &["--sun", &turned, "--env-rotate", "50"]);
        let far = image.data.iter().zip(&again.data).filter(|(a, b)| a.abs_diff(**b) > 12).count();
        assert!(far < image.data.len() / 100, "{far}");
        // With a sky, shadows have light.
        let sky = picture(&toy, &format!("sky{azimuth}"), &["--sun", &sun, "--sky"]);
        assert!(at(&toy, &sky, if azimuth == 90 { left } else { right })[2] > 20.0);
    }
}

#[test]
fn an_automatic_exposure_is_said_and_keeps_the_ground_as_bright() {
    let toy = toy_scene();
    let done = relight(
        &toy,
        &[
            &VIEW[..],
            &["--sun", "azimuth=0,elevation=20", "--sky", "--env-exposure", "ground", "-o", "a"],
        ]
        .concat(),
    );
    assert_code(&done, 0);
    assert!(text(&done).contains("automatic: a white sheet"), "{}", text(&done));
    let image = read_image(&toy.path("a/view_0.png")).unwrap();
    let luminance = |c: [f32; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    let (got, own) =
        (luminance(at(&toy, &image, [1.2, -1.0, 0.0])), luminance(FLOOR.map(|c| encode(0.5 * c))));
    assert!((got - own).abs() < 14.0, "{got} {own}");
}

#[test]
fn an_exposure_is_metered_said_and_darker_at_dusk() {
    let toy = toy_scene();
    let mean = |folder: &str| {
        let image = read_image(&toy.path(folder).join("view_0.png")).unwrap();
        image.data.iter().map(|v| f64::from(*v)).sum::<f64>() / image.data.len() as f64
    };
    let lit = |folder: &str, light: &[&str]| {
        let black = ["--background", "black", "-o", folder];
        let done = relight(&toy, &[&VIEW[..], light, &black].concat());
        assert_code(&done, 0);
        text(&done)
    };
    lit("own", &[]);
    let noon = lit("noon", &["--sun", "noon"]);
    assert!(noon.contains("noon: sun and sky") && noon.contains("EV 1"), "{noon}");
    assert!(noon.contains("metered: the pictures"), "{noon}");
    lit("sunrise", &["--sun", "sunrise"]);
    lit("overcast", &["--sun", "overcast"]);
    assert!((mean("noon") / mean("own") - 1.0).abs() < 0.15, "{} {}", mean("noon"), mean("own"));
    assert!(mean("sunrise") < 0.92 * mean("noon"), "{} {}", mean("sunrise"), mean("noon"));
    assert!(mean("overcast") < 0.95 * mean("noon"));
    // A parameter on top, and what it does to the highlights is said; a film curve keeps them.
    let bright = lit("bright", &["--sun", "noon", "--exposure-compensation", "2"]);
    assert!(bright.contains("brighter than white and clipped"), "{bright}");
    assert!(!noon.contains("clipped"), "{noon}");
    let film = lit("film", &["--sun", "noon", "--ev", "2", "--view-transform", "agx"]);
    assert!(!film.contains("clipped"), "{film}");
    let white = |folder: &str| {
        let image = read_image(&toy.path(folder).join("view_0.png")).unwrap();
        image.data.iter().filter(|v| **v == 255).count()
    };
    assert!(white("film") == 0 && white("bright") > 100);
}

#[test]
fn a_view_transform_leaves_exr_files_alone() {
    let toy = toy_scene();
    let both = ["--sun", "noon", "--format", "both"];
    picture(&toy, "standard", &both);
    picture(&toy, "agx", &[&both[..], &["--view-transform", "agx"]].concat());
    let bytes = |path: &str| std::fs::read(toy.path(path)).unwrap();
    assert_eq!(bytes("standard/view_0.exr"), bytes("agx/view_0.exr"));
    assert_ne!(bytes("standard/view_0.png"), bytes("agx/view_0.png"));
}

#[test]
fn components_add_up_and_come_with_buffers() {
    let toy = toy_scene();
    let arguments = ["--format", "both", "--background", "transparent", "--bounces", "1"];
    let image = picture(&toy, "both", &arguments);
    assert_eq!(image.channels, 4);
    let exr = open_exr(&toy.path("both/view_0.exr")).unwrap();
    let of = |name: &str| exr.channel(name).unwrap_or_else(|| panic!("no {name}")).to_f32();
    let names = ["R", "diffuse.R", "specular.R", "indirect.R"];
    let [total, diffuse, specular, indirect] = names.map(of);
    for i in 0..total.len() {
        assert!((total[i] - diffuse[i] - specular[i] - indirect[i]).abs() < 2e-3);
        assert!(specular[i] == 0.0, "this scene has no specular lobe");
    }
    assert!(indirect.iter().any(|v| *v > 0.002), "light comes over the box and the floor");
    let (x, y) = pixel_of(&toy, DVec3::new(0.0, 0.0, 0.6));
    let i = y * image.width + x;
    assert!((of("base_color.B")[i] - BOX[2]).abs() < 0.02 && of("normal.Z")[i] > 0.99);
    let z = toy.capture.views[0].camera_from_world.transform_point(DVec3::new(0.0, 0.0, 0.6)).z;
    assert!((f64::from(of("depth.Z")[i]) - z).abs() < 0.05 && of("visibility.V")[i] > 0.95);
    assert!((of("roughness.V")[i] - 0.9).abs() < 0.02 && of("A")[i] > 0.99);
}

#[test]
fn backgrounds_are_what_they_say() {
    let toy = toy_scene();
    toy.map("even.exr", 2, 1, |_, _| [0.2, 0.4, 0.6]);
    // A pose that sees past the floor.
    let look = |name: &str, background: &str| {
        let done = relight(
            &toy,
            &[
                "--capture",
                "capture.json",
                "--environment",
                "even.exr",
                "--view",
                "view_0.png",
                "--width",
                "300",
                "--height",
                "60",
                "--background",
                background,
                "-o",
                name,
            ],
        );
        assert_code(&done, 0);
        let image = read_image(&toy.path(name).join("view_0.png")).unwrap();
        image.pixel(0, 0).to_vec()
    };
    let environment = look("e", "environment");
    assert!((f32::from(environment[2]) - encode(0.6)).abs() <= 1.0, "{environment:?}");
    assert_eq!(look("c", "1,0,0"), [255, 0, 0]);
    assert_eq!(look("t", "transparent")[3], 0);
    assert_eq!(look("k", "captured"), [0, 0, 0]);
}

#[test]
fn extreme_maps_give_finite_pictures_and_say_what_was_repaired() {
    let toy = toy_scene();
    toy.map("black.exr", 4, 2, |_, _| [0.0; 3]);
    let done = relight(&toy, &[&VIEW[..], &["--environment", "black.exr", "-o", "black"]].concat());
    assert_code(&done, 0);
    assert!(text(&done).contains("the environment is black"));
    let image = read_image(&toy.path("black/view_0.png")).unwrap();
    assert!(image.data.iter().all(|v| *v == 0));

    toy.map("tall.exr", 1, 2, |_, y| if y == 0 { [1.0; 3] } else { [0.0; 3] });
    let image =
        picture(&toy, "tall", &["--environment", "tall.exr", "--env-convention", "blender"]);
    assert!(at(&toy, &image, [0.0, 0.0, 0.6])[2] > 150.0);

    toy.map("sun.exr", 64, 32, |x, y| if (x, y) == (16, 8) { [1e6; 3] } else { [0.0; 3] });
    let sun = ["--environment", "sun.exr", "--env-convention", "blender", "--env-exposure", "2e-4"];
    let image = picture(&toy, "sun", &[&sun[..], &["--quality", "reference"]].concat());
    let standard = picture(&toy, "sun-standard", &sun);
    let (lit, dark) = ([0.0, 0.0, 0.6], [0.1, -0.6, 0.0]);
    // About 45 degrees high: irradiance is radiance times the solid angle of the pixel times the cosine.
    let texel = std::f32::consts::PI / 32.0;
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let e = 1e6 * 2e-4 * texel * texel * half * half / std::f32::consts::PI;
    assert_near(at(&toy, &image, lit), BOX.map(|c| c * e), 8.0);
    assert_near(at(&toy, &standard, lit), BOX.map(|c| c * e), 12.0);
    assert!(at(&toy, &image, dark)[0] < 5.0, "the shadow of the box");

    let odd = [f32::NAN, f32::INFINITY, -4.0, 0.3];
    toy.map("odd.exr", 4, 2, |x, _| [odd[x], 0.3, 0.3]);
    let done = relight(&toy, &[&VIEW[..], &["--environment", "odd.exr", "-o", "odd"]].concat());
    assert_code(&done, 0);
    let said = text(&done);
    assert!(said.contains("2 negative and 2 NaN became 0, 2 infinite"), "{said}");
}

#[test]
fn threads_change_no_byte() {
    let toy = toy_scene();
    let one =
        picture(&toy, "one", &["--threads", "1", "--sun", "azimuth=60,elevation=35", "--sky"]);
    let two =
        picture(&toy, "two", &["--threads", "2", "--sun", "azimuth=60,elevation=35", "--sky"]);
    assert_eq!(one, two);
    for threads in ["1", "2"] {
        let name = format!("{threads}.ply");
        assert_code(&relight(&toy, &["--threads", threads, "-o", &name, "--bounces", "1"]), 0);
    }
    assert_eq!(
        std::fs::read(toy.path("1.ply")).unwrap(),
        std::fs::read(toy.path("2.ply")).unwrap()
    );
}

#[test]
fn what_is_missing_is_named_with_the_stage_that_makes_it() {
    let toy = toy_scene();
    let path = toy.path("scene/gaussians.ply");
    let mut gaussians = read_gaussians(&path).unwrap();
    gaussians.extra.retain(|c| c.name != "metallic");
    write_gaussians(&path, &gaussians, &PlyWriteOptions::default()).unwrap();
    let done = relight(&toy, &[&VIEW[..], &["-o", "out"]].concat());
    assert_code(&done, 3);
    let said = text(&done);
    assert!(said.contains("no column \"metallic\"") && said.contains("decompose"), "{said}");
    std::fs::remove_file(toy.path("scene/environment.exr")).unwrap();
    assert_code(&relight(&toy, &[&VIEW[..], &["-o", "out"]].concat()), 3);
    assert_code(&relight(&toy, &["-o", "out", "--capture", "capture.json"]), 2);
    assert_code(&relight(&toy, &[&VIEW[..], &["--sky", "-o", "out"]].concat()), 2);
    assert!(!toy.path("out").exists());
}

#[test]
fn files_that_do_not_belong_together_are_noticed() {
    let toy = toy_scene();
    let path = toy.path("scene/gaussians.ply");
    let mut gaussians = read_gaussians(&path).unwrap();
    gaussians.gather(&[0, 1, 2]);
    write_gaussians(&path, &gaussians, &PlyWriteOptions::default()).unwrap();
    let done = relight(&toy, &[&VIEW[..], &["-o", "out"]].concat());
    assert_code(&done, 0);
    assert!(text(&done).contains("the files have 3 Gaussians"), "{}", text(&done));
}
