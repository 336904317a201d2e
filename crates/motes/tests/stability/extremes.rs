//! Models, captures and budgets at the ends of what a file may hold.

use std::fs;
use std::time::Instant;

use motes_formats::exr_aov::read_exr;
use motes_formats::images::read_image;
use motes_scene::Gaussians;

use super::bench::{Bench, EVALUATE, RENDER, TRAIN, clear_error};

fn one(value: f32) -> Gaussians {
    Gaussians {
        means: vec![[value; 3]],
        rotations: vec![[1.0, 0.0, 0.0, 0.0]],
        log_scales: vec![[0.0; 3]],
        opacity_logits: vec![2.0],
        sh_degree: 0,
        sh: vec![0.3; 3],
        extra: Vec::new(),
    }
}

fn write(bench: &Bench, name: &str, gaussians: &Gaussians) {
    motes_testkit::write_broken_gaussians(&bench.path(name), gaussians);
}

const CAPTURE: [&str; 3] = ["--capture", "cap/capture.json", "-q"];

fn render<'a>(model: &'a str, output: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&CAPTURE[..], &["--gaussians", model, "-o", output, "--view", "view_01.png"], more].concat()
}

#[test]
fn no_gaussians_and_one_gaussian_are_models() {
    let bench = Bench::with_capture();
    write(&bench, "none.ply", &Gaussians::empty(0));
    write(&bench, "one.ply", &one(0.0));
    for model in ["none.ply", "one.ply"] {
        let folder = model.replace(".ply", "");
        bench.ok(RENDER, &render(model, &folder, &["--aov", "depth,normal"]));
        assert!(bench.psnr(model) > 1.0);
    }
    let line = ["-o", "grown.ply", "-n=20", "--init-ply", "one.ply"];
    bench.ok(TRAIN, &[&CAPTURE[..], &line].concat());
    let line = ["-o", "empty.ply", "-n=20", "--init-ply", "none.ply"];
    bench.ok(TRAIN, &[&CAPTURE[..], &line].concat());
}

#[test]
fn values_that_are_no_numbers_never_reach_a_picture() {
    let bench = Bench::with_capture();
    let mut broken = one(0.0);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38, -1e38] {
        for column in 0..5 {
            let mut g = one(0.0);
            match column {
                0 => g.means[0][1] = value,
                1 => g.rotations[0] = [value; 4],
                2 => g.log_scales[0][2] = value,
                3 => g.opacity_logits[0] = value,
                _ => g.sh[1] = value,
            }
            broken.means.extend(g.means);
            broken.rotations.extend(g.rotations);
            broken.log_scales.extend(g.log_scales);
            broken.opacity_logits.extend(g.opacity_logits);
            broken.sh.extend(g.sh);
        }
    }
    write(&bench, "broken.ply", &broken);
    let output = bench.run(RENDER, &render("broken.ply", "b", &["--format", "exr"]));
    if !output.status.success() {
        clear_error(&output, &["broken.ply"]);
        return;
    }
    for entry in fs::read_dir(bench.path("b")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "exr") {
            for channel in read_exr(&path).unwrap().2 {
                assert!(channel.to_f32().iter().all(|v| v.is_finite()), "{}", channel.name);
            }
        }
    }
    let line = ["-o", "fit.ply", "-n=20", "--init-ply", "broken.ply"];
    bench.ok(TRAIN, &[&CAPTURE[..], &line].concat());
}

#[test]
fn a_picture_of_one_pixel_and_one_of_64_million() {
    let bench = Bench::with_capture();
    write(&bench, "one.ply", &one(0.0));
    for (width, height) in [("1", "1"), ("9000", "7200")] {
        let line = render("one.ply", width, &["--width", width, "--height", height]);
        let start = Instant::now();
        bench.ok(RENDER, &line);
        let seconds = start.elapsed().as_secs_f64();
        let picture = read_image(&bench.path(width).join("view_01.png")).unwrap();
        assert_eq!(picture.width.to_string(), width);
        assert!(picture.data.iter().any(|&v| v > 20), "{width}: black");
        assert!(seconds < 60.0, "{width}: {seconds:.1} s");
    }
}

#[test]
fn a_million_gaussians_in_one_place_take_seconds() {
    let bench = Bench::with_capture();
    let n = 1_000_000;
    let coincident = Gaussians {
        means: vec![[0.0, 0.0, 1.0]; n],
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; n],
        log_scales: vec![[-1.0; 3]; n],
        opacity_logits: vec![-3.0; n],
        sh_degree: 0,
        sh: vec![0.2; 3 * n],
        extra: Vec::new(),
    };
    write(&bench, "many.ply", &coincident);
    let start = Instant::now();
    bench.ok(RENDER, &render("many.ply", "many", &[]));
    let seconds = start.elapsed().as_secs_f64();
    assert!(seconds < 30.0, "{seconds:.1} s");
}

#[test]
fn radiance_over_16_decades_survives_exr() {
    let bench = Bench::with_capture();
    for exponent in [-8, -4, 0, 4, 8] {
        let mut g = one(0.0);
        // The linear value 10^exponent, sRGB-encoded as the transfer function continues beyond 1.
        let linear = 10f64.powi(exponent);
        let encoded = match linear <= 0.003_130_8 {
            true => 12.92 * linear,
            false => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
        };
        g.sh = vec![((encoded - 0.5) / 0.282_094_791_773_878) as f32; 3];
        g.opacity_logits = vec![20.0];
        g.log_scales = vec![[1.0; 3]];
        let name = format!("hdr{exponent}");
        write(&bench, &format!("{name}.ply"), &g);
        bench.ok(RENDER, &render(&format!("{name}.ply"), &name, &["--format", "exr"]));
        let channels = read_exr(&bench.path(&name).join("view_01.exr")).unwrap().2;
        let brightest = channels
            .iter()
            .filter(|channel| channel.name == "G")
            .flat_map(|channel| channel.to_f32())
            .fold(0.0f32, f32::max);
        // Alpha is at most 0.99, and a color near 0 is a difference from one half.
        let expected = linear * 0.99f64.powf(if linear > 0.01 { 2.4 } else { 1.0 });
        let error = (f64::from(brightest) - expected).abs();
        assert!(error < 0.02 * linear + 1e-8, "1e{exponent}: {brightest:e} for {expected:e}");
        for channel in &channels {
            assert!(channel.to_f32().iter().all(|v| v.is_finite()), "1e{exponent}");
        }
    }
}

#[test]
fn a_budget_of_one_second_gives_a_model() {
    let bench = Bench::with_capture();
    let start = Instant::now();
    let line = ["-o", "quick.ply", "--time-budget", "1"];
    bench.ok(TRAIN, &[&CAPTURE[..], &line].concat());
    let seconds = start.elapsed().as_secs_f64();
    assert!((0.9..6.0).contains(&seconds), "{seconds:.2} s");
    assert!(bench.psnr("quick.ply") > 8.0);
    for budget in ["0", "-1", "nan", "inf"] {
        let budget = format!("--time-budget={budget}");
        let line = ["-o", "never.ply", &budget];
        let output = bench.run(TRAIN, &[&CAPTURE[..], &line].concat());
        clear_error(&output, &["time-budget"]);
    }
}

#[test]
fn captures_with_numbers_that_are_none_are_refused() {
    let bench = Bench::with_fit();
    let document = fs::read_to_string(bench.path("cap/capture.json")).unwrap();
    let start = document.find("\"translation\"").unwrap();
    let number = start
        + document[start..].find(['-', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']).unwrap();
    let length = document[number..].find([',', '\n', ']']).unwrap();
    for bad in ["1e999", "null", "NaN", "\"a\""] {
        let text = format!("{}{bad}{}", &document[..number], &document[number + length..]);
        fs::write(bench.path("cap/bad.json"), text).unwrap();
        for (program, line) in [
            (TRAIN, vec!["--capture", "cap/bad.json", "-o", "x.ply", "-n=2", "-q"]),
            (EVALUATE, vec!["--capture", "cap/bad.json", "--gaussians", "g.ply", "-q"]),
            (
                RENDER,
                vec![
                    "--capture",
                    "cap/bad.json",
                    "--gaussians",
                    "g.ply",
                    "-o",
                    "x",
                    "--split",
                    "all",
                    "-q",
                ],
            ),
        ] {
            clear_error(&bench.run(program, &line), &["bad.json"]);
        }
    }
}
