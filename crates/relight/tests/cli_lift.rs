//! `relight --from-images`: views that were relit one by one, some of them wrongly, become a splat.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]
#![allow(clippy::print_stdout, reason = "shown with --nocapture")]

use std::path::Path;
use std::process::{Command, Output};

use motes_formats::capture::write_capture;
use motes_formats::images::write_png;
use motes_formats::ply::{PlyWriteOptions, read_gaussians, write_gaussians};
use motes_math::srgb;
use motes_raster::{RenderOptions, render};
use motes_scene::{Capture, Gaussians, ImageF32, ImageU8, Split};
use motes_testkit::toy_scene::{ToyScene, capture, toy_scene};

const SH_C0: f32 = 0.282_094_8;

/// A textured scene in even light, the same under a warm light from one side, and twelve views.
struct Case {
    toy: ToyScene,
    capture: Capture,
    truth: Gaussians,
}

fn case() -> Case {
    let toy = toy_scene();
    let mut plain = read_gaussians(&toy.path("scene/gaussians.ply")).unwrap();
    let mut truth = plain.clone();
    for i in 0..plain.len() {
        let [x, y, _] = plain.means[i];
        let texture = 0.75 + 0.25 * (9.0 * x).sin() * (7.0 * y).cos();
        for c in 0..3 {
            let color = (0.5 + SH_C0 * plain.sh[3 * i + c]) * texture;
            plain.sh[3 * i + c] = (color - 0.5) / SH_C0;
            // Smooth over the scene: three times as bright on one side, and warm.
            let light = [1.3, 0.9, 0.6][c] * (1.0 + 0.25 * x) * (1.0 + 0.1 * y);
            let lit = srgb::encode(srgb::decode(color) * light);
            truth.sh[3 * i + c] = (lit - 0.5) / SH_C0;
        }
    }
    write_gaussians(&toy.path("plain.ply"), &plain, &PlyWriteOptions::default()).unwrap();
    let capture = capture(12, 0.5);
    write_capture(&toy.path("capture.json"), &capture).unwrap();
    Case { toy, capture, truth }
}

impl Case {
    fn show(&self, gaussians: &Gaussians, view: usize) -> ImageF32 {
        let camera = self.capture.cameras[0].as_pinhole().unwrap();
        let pose = &self.capture.views[view].camera_from_world;
        render(gaussians, &camera, pose, &RenderOptions::default()).color
    }

    /// Writes the relit training views, each changed by `spoil`.
    fn write_views(&self, folder: &str, spoil: impl Fn(usize, ImageU8) -> ImageU8) {
        for view in self.capture.views_of(Split::Train) {
            let picture = spoil(view, self.show(&self.truth, view).to_u8());
            let path = self.toy.path(folder).join(&self.capture.views[view].name);
            write_png(&path, &picture).unwrap();
        }
    }

    fn lift(&self, folder: &str, output: &str, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_relight"))
            .args(["--capture", "capture.json", "--gaussians", "plain.ply", "--no-provenance"])
            .args(["--from-images", folder, "-o", output])
            .args(arguments)
            .current_dir(self.toy.folder.path())
            .output()
            .unwrap()
    }

    /// Lifts and compares with the truth in the held-out views.
    #[track_caller]
    fn psnr(&self, folder: &str, arguments: &[&str]) -> f64 {
        let output = format!("{folder}-{}.ply", arguments.concat());
        let done = self.lift(folder, &output, arguments);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let lifted = read_gaussians(&self.toy.path(&output)).unwrap();
        self.psnr_of(&lifted)
    }

    fn psnr_of(&self, lifted: &Gaussians) -> f64 {
        let views = self.capture.views_of(Split::Test);
        let of = |view: &usize| {
            let (a, b) = (self.show(lifted, *view), self.show(&self.truth, *view));
            let square = |(a, b): (&f32, &f32)| f64::from((a - b).powi(2));
            let error: f64 = a.data.iter().zip(&b.data).map(square).sum();
            -10.0 * (error / a.data.len() as f64).log10()
        };
        views.iter().map(of).sum::<f64>() / views.len() as f64
    }
}

/// One view twice as bright (linear), one with its hues shifted, one garbage.
fn spoil(view: usize, image: ImageU8) -> ImageU8 {
    let mut out = image.clone();
    for (i, pixel) in out.data.chunks_exact_mut(3).enumerate() {
        match view {
            3 => {
                for v in pixel {
                    let bright = 2.0 * srgb::decode(f32::from(*v) / 255.0);
                    *v = (srgb::encode(bright).min(1.0) * 255.0) as u8;
                }
            }
            6 => pixel.rotate_left(1),
            9 => {
                let [x, y] = [i % image.width / 9, i / image.width / 7];
                let noise = |c: usize| ((x * 7919 + y * 104_729 + c * 1_299_709) % 251) as u8;
                pixel.iter_mut().enumerate().for_each(|(c, v)| *v = noise(c));
            }
            _ => {}
        }
    }
    out
}

#[test]
fn views_that_agree_give_their_light_back() {
    let case = case();
    case.write_views("relit", |_, image| image);
    let before = case.psnr_of(&read_gaussians(&case.toy.path("plain.ply")).unwrap());
    let bake = case.psnr("relit", &[]);
    let refit = case.psnr("relit", &["--lift", "refit"]);
    println!("before {before:.2} dB, bake {bake:.2}, refit {refit:.2}");
    assert!(bake > before + 10.0 && bake > 28.0, "{before} {bake}");
    assert!(refit > bake, "{bake} {refit}");
}

#[test]
fn views_that_disagree_lose_to_the_majority() {
    let case = case();
    case.write_views("relit", |_, image| image);
    case.write_views("spoiled", spoil);
    for method in ["bake", "refit"] {
        let with =
            |folder, agreement| case.psnr(folder, &["--lift", method, "--agreement", agreement]);
        let clean = with("relit", "robust");
        let (robust, mean) = (with("spoiled", "robust"), with("spoiled", "mean"));
        println!("{method}: all agree {clean:.2} dB; spoiled: robust {robust:.2}, mean {mean:.2}");
        // Beyond 46 dB differences are below a step of 8 bits.
        assert!(robust > clean.min(46.0) - 2.0, "{method}: {clean} {robust}");
        assert!(robust > mean + 10.0, "{method}: {robust} {mean}");
    }
    let done = case.lift("spoiled", "again.ply", &["--json"]);
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    let views = report["views"].as_array().unwrap();
    let of = |name: &str| views.iter().find(|v| v["name"] == name).unwrap();
    let gain = of("view_3.png")["gain_rgb"][1].as_f64().unwrap();
    assert!((1.6..2.4).contains(&gain), "{gain}");
    let weight = |name| of(name)["weight"].as_f64().unwrap();
    assert!(weight("view_9.png") < 0.3 && weight("view_0.png") > 0.5, "{report}");
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(said.contains("view_9.png disagrees with the other views"), "{said}");
}

#[test]
fn masked_pixels_say_nothing() {
    let mut case = case();
    case.write_views("relit", |_, image| image);
    // Left halves are painted over and masked.
    let half = |image: ImageU8| {
        let mut out = image;
        for i in (0..out.pixel_count()).filter(|i| i % out.width < out.width / 2) {
            out.data[3 * i..3 * i + 3].copy_from_slice(&[0, 255, 0]);
        }
        out
    };
    case.write_views("painted", |_, image| half(image));
    let unmasked = case.psnr("painted", &["--agreement", "mean"]);
    let mut mask = ImageU8::filled(80, 60, 1, 255);
    (0..mask.data.len()).filter(|i| i % 80 < 40).for_each(|i| mask.data[i] = 0);
    let rgb = ImageU8::from_data(80, 60, 3, mask.data.iter().flat_map(|v| [*v; 3]).collect());
    write_png(&case.toy.path("mask.png"), &rgb).unwrap();
    case.capture.views.iter_mut().for_each(|v| v.mask = Some("mask.png".into()));
    write_capture(&case.toy.path("capture.json"), &case.capture).unwrap();
    let masked = case.psnr("painted", &["--agreement", "mean", "--lift", "bake"]);
    println!("painted over: {unmasked:.2} dB, with masks {masked:.2}");
    assert!(masked > unmasked + 6.0, "{unmasked} {masked}");
}

#[test]
fn threads_change_no_byte() {
    let case = case();
    case.write_views("relit", spoil);
    for (threads, name) in [("1", "one.ply"), ("2", "two.ply")] {
        let done = case.lift("relit", name, &["--lift", "refit", "--threads", threads]);
        assert!(done.status.success());
    }
    let read = |name: &str| std::fs::read(case.toy.path(name)).unwrap();
    assert_eq!(read("one.ply"), read("two.ply"));
}

#[test]
fn pictures_must_belong_to_views() {
    let case = case();
    let code = |folder: &str, arguments: &[&str]| {
        let done = case.lift(folder, "out.ply", arguments);
        assert!(!case.toy.path("out.ply").exists());
        (done.status.code().unwrap(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    assert_eq!(code("nowhere", &[]).0, 3);
    let put = |name: &str, width| {
        write_png(&case.toy.path(name), &ImageU8::filled(width, 60, 3, 9)).unwrap();
    };
    put("odd/other.png", 80);
    let (status, said) = code("odd", &[]);
    assert!(status == 3 && said.contains("no picture is named after a view"), "{said}");
    put("wide/view_0.png", 120);
    let (status, said) = code("wide", &[]);
    assert!(status == 3 && said.contains("120 x 60 pixels, its view 80 x 60"), "{said}");
    put("two/view_0.png", 80);
    std::fs::copy(case.toy.path("two/view_0.png"), case.toy.path("two/view_0.jpg")).unwrap();
    assert!(code("two", &[]).1.contains("two pictures of one view"));
    assert_eq!(code("two", &["--scene", "scene"]).0, 2);
    assert!(Path::new(&case.toy.path("scene")).exists());
}

/// The provider of tests: linear gains that the prompt says, and another exposure for each picture.
const PROVIDER: &str =
    concat!("python3 ", env!("CARGO_MANIFEST_DIR"), "/../../testdata/providers/warm_light.py");

impl Case {
    fn by_provider(&self, output: &str, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_relight"))
            .args(["--capture", "capture.json", "--gaussians", "plain.ply", "--provider", PROVIDER])
            .args(["--provider-cache", "answers", "-o", output])
            .args(arguments)
            .current_dir(self.toy.folder.path())
            .output()
            .unwrap()
    }
}

#[test]
fn a_provider_relights_the_views_and_they_become_one_splat() {
    let mut case = case();
    // What the provider does to every picture, done to the Gaussians.
    let plain = read_gaussians(&case.toy.path("plain.ply")).unwrap();
    case.truth = plain.clone();
    for (i, value) in case.truth.sh.iter_mut().enumerate() {
        let gain = [1.5, 1.0, 0.5][i % 3];
        *value = (srgb::encode(srgb::decode(0.5 + SH_C0 * *value) * gain) - 0.5) / SH_C0;
    }
    let prompt = "red 1.5 green 1 blue 0.5";
    let line = ["--prompt", prompt, "--provider-pictures", "made", "--json"];
    let done = case.by_provider("lit.ply", &line);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    let train = case.capture.views_of(Split::Train).len();
    assert_eq!(report["provider"]["name"], "warm-light");
    assert_eq!(
        (&report["provider"]["answered"], &report["provider"]["kept"]),
        (&train.into(), &0.into())
    );
    assert_eq!(std::fs::read_dir(case.toy.path("made")).unwrap().count(), train);
    let lit = read_gaussians(&case.toy.path("lit.ply")).unwrap();
    let (before, after) = (case.psnr_of(&plain), case.psnr_of(&lit));
    println!("before {before:.1} dB, lit {after:.1} dB");
    assert!(after > 30.0 && after > before + 8.0, "{before:.1} {after:.1}");
    // The same again asks nobody, and a few views do.
    let again = case.by_provider("again.ply", &["--prompt", prompt, "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(
        (&report["provider"]["answered"], &report["provider"]["kept"]),
        (&0.into(), &train.into())
    );
    assert_eq!(read_gaussians(&case.toy.path("again.ply")).unwrap(), lit);
    let few =
        case.by_provider("few.ply", &["--prompt", "blue 2", "--provider-views", "3", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&few.stdout).unwrap();
    assert_eq!(report["views"].as_array().unwrap().len(), 3);
}

#[test]
fn a_picture_gives_the_light_and_wrong_lines_are_refused() {
    let case = case();
    write_png(
        &case.toy.path("room.png"),
        &ImageU8::from_data(2, 1, 3, vec![255, 60, 60, 255, 60, 60]),
    )
    .unwrap();
    let done =
        case.by_provider("red.ply", &["--background-picture", "room.png", "--provider-views", "4"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let [plain, red] =
        ["plain.ply", "red.ply"].map(|name| read_gaussians(&case.toy.path(name)).unwrap());
    let mean = |g: &Gaussians, c: usize| {
        (0..g.len()).map(|i| g.sh[3 * i + c]).sum::<f32>() / g.len() as f32
    };
    assert!(mean(&red, 0) - mean(&plain, 0) > mean(&red, 2) - mean(&plain, 2) + 0.3);
    for (line, said) in [
        (&[][..], "not told which light"),
        (&["--prompt", "x", "--from-images", "made"], "--from-images"),
        (&["--prompt", "x", "--scene", "scene"], "--scene"),
    ] {
        let done = case.by_provider("no.ply", line);
        let text = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{text}");
        assert!(text.contains(said), "{text}");
    }
    assert!(!case.toy.path("no.ply").exists());
}
