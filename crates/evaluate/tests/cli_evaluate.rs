//! The stage `evaluate` as a program: scores, documents, pages, bounds, exit codes.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::collections::BTreeMap;
use std::process::Output;

use motes_formats::images::{read_image, write_png};
use motes_formats::ply::{PlyWriteOptions, write_gaussians};
use motes_formats::tensors::{TensorData, write_tensors};
use motes_scene::ImageU8;
use motes_testkit::toy_capture::{ToyCapture, assert_code, run, stderr, toy_capture};
use serde_json::Value;

fn evaluate(toy: &ToyCapture, arguments: &[&str]) -> Output {
    let mut all = vec!["--capture", "capture.json", "--no-provenance"];
    all.extend(arguments);
    run(env!("CARGO_BIN_EXE_evaluate"), toy.folder.path(), &all)
}

/// Writes the model with its colors changed by `by`.
fn write_changed(toy: &ToyCapture, name: &str, by: f32) {
    let mut changed = toy.gaussians.clone();
    changed.sh.iter_mut().enumerate().for_each(|(i, v)| *v += by * (i as f32).sin());
    write_gaussians(&toy.path(name), &changed, &PlyWriteOptions::default()).unwrap();
}

fn json(output: &Output) -> Value {
    assert_code(output, 0);
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_true_model_scores_the_cap_on_every_view() {
    let toy = toy_capture();
    let report = json(&evaluate(&toy, &["--gaussians", "true.ply", "--split", "test", "--json"]));
    assert_eq!(report["format"], "motes/metrics");
    assert_eq!(report["psnr"], 128.0);
    assert!(report["ssim"].as_f64().unwrap() > 0.999_999);
    let psnr_float = report["psnr_float"].as_f64().unwrap();
    assert!((55.0..70.0).contains(&psnr_float), "8-bit photos: {psnr_float}");
    let names: Vec<_> = report["views"].as_array().unwrap().iter().map(|v| &v["name"]).collect();
    assert_eq!(names, ["view_2.png", "view_5.png"]);
    assert_eq!(report["protocol"]["psnr"]["cap_db"], 128.0);
    assert!(report["lpips"].is_null());
    assert!(report["protocol"]["lpips_reason"].as_str().unwrap().contains("--lpips-weights"));
}

#[test]
fn the_mean_is_that_of_the_views_and_the_gap_needs_both_splits() {
    let toy = toy_capture();
    write_changed(&toy, "changed.ply", 0.2);
    let report = json(&evaluate(&toy, &["--gaussians", "changed.ply", "--gap", "--json"]));
    let views = report["views"].as_array().unwrap();
    assert_eq!(views.len(), 8);
    let mean = |split: &str| {
        let of_split = views.iter().filter(|view| view["split"] == split);
        let psnrs: Vec<f64> = of_split.map(|view| view["psnr"].as_f64().unwrap()).collect();
        psnrs.iter().sum::<f64>() / psnrs.len() as f64
    };
    let psnr = report["psnr"].as_f64().unwrap();
    assert!((psnr - mean("test")).abs() < 1e-9 && (15.0..40.0).contains(&psnr), "{psnr}");
    let gap = report["gap"].as_f64().unwrap();
    assert!((gap - (mean("train") - mean("test"))).abs() < 1e-9);
    let without = json(&evaluate(&toy, &["--gaussians", "changed.ply", "--json"]));
    assert!(without["gap"].is_null() && without["train"].is_null());
}

#[test]
fn models_of_several_seeds_give_mean_and_spread() {
    let toy = toy_capture();
    write_changed(&toy, "a.ply", 0.1);
    write_changed(&toy, "b.ply", 0.3);
    let report = json(&evaluate(&toy, &["--gaussians", "a.ply", "--gaussians", "b.ply", "--json"]));
    let rows = report["seeds"]["rows"].as_array().unwrap();
    let psnrs: Vec<f64> = rows.iter().map(|row| row["psnr"].as_f64().unwrap()).collect();
    let mean = (psnrs[0] + psnrs[1]) / 2.0;
    let deviation = (psnrs[0] - psnrs[1]).abs() / 2f64.sqrt();
    assert!((report["psnr"].as_f64().unwrap() - mean).abs() < 1e-9);
    let reported = report["seeds"]["deviation"]["psnr"].as_f64().unwrap();
    assert!((reported - deviation).abs() < 1e-9 && deviation > 1.0, "{reported} {deviation}");
}

#[test]
fn another_programs_renders_score_as_the_model_does() {
    let toy = toy_capture();
    write_changed(&toy, "changed.ply", 0.2);
    let saved = &["--gaussians", "changed.ply", "--save-renders", "saved", "--json"];
    let model = json(&evaluate(&toy, saved));
    let folder = json(&evaluate(&toy, &["--renders", "saved", "--json"]));
    assert_eq!(model["psnr"], folder["psnr"]);
    assert_eq!(model["ssim"], folder["ssim"]);
    std::fs::remove_file(toy.path("saved/view_5.png")).unwrap();
    let missing = evaluate(&toy, &["--renders", "saved"]);
    assert_code(&missing, 3);
    assert!(stderr(&missing).contains("view_5.png"), "{}", stderr(&missing));
}

#[test]
fn a_missed_bound_is_exit_code_4_with_the_report_still_there() {
    let toy = toy_capture();
    write_changed(&toy, "changed.ply", 0.2);
    let bounds = ["--gaussians", "changed.ply", "--json", "--require"];
    let missed = evaluate(&toy, &[&bounds[..], &["psnr>=90"]].concat());
    assert_code(&missed, 4);
    assert!(stderr(&missed).contains("psnr>=90 not met: psnr is "), "{}", stderr(&missed));
    let report: Value = serde_json::from_slice(&missed.stdout).unwrap();
    assert!(report["psnr"].is_number());
    assert_code(&evaluate(&toy, &[&bounds[..], &["psnr>=10", "--require", "gap<=20"]].concat()), 0);
    assert_code(&evaluate(&toy, &[&bounds[..], &["psnr>10"]].concat()), 2);
    assert_code(&evaluate(&toy, &[&bounds[..], &["lpips<=0.1"]].concat()), 2);
}

#[test]
fn page_and_metrics_are_written_and_not_replaced() {
    let toy = toy_capture();
    write_changed(&toy, "changed.ply", 0.2);
    let write = ["--gaussians", "changed.ply", "--report", "out/r.html", "--metrics", "out/m.json"];
    let done = evaluate(&toy, &write);
    assert_code(&done, 0);
    assert!(done.stdout.is_empty(), "nothing on stdout without --json");
    let html = std::fs::read_to_string(toy.path("out/r.html")).unwrap();
    assert_eq!(html.matches("<figure class=\"compare\">").count(), 2);
    assert!(
        html.contains("data:image/jpeg;base64,")
            && !html.replace("http-equiv=", "").contains("http")
    );
    let metrics: Value =
        serde_json::from_slice(&std::fs::read(toy.path("out/m.json")).unwrap()).unwrap();
    assert_eq!(metrics["views"].as_array().unwrap().len(), 2);
    assert_code(&evaluate(&toy, &write), 2);
    assert_code(&evaluate(&toy, &[&write[..], &["-w"]].concat()), 0);
}

#[test]
fn masked_out_pixels_do_not_count() {
    let mut toy = toy_capture();
    // The photo of the first test view is spoilt on its left half, which a mask takes out.
    let photo = toy.path("images/view_2.png");
    let mut image = read_image(&photo).unwrap();
    let mut mask = ImageU8::filled(64, 48, 1, 255);
    for y in 0..48 {
        for x in 0..32 {
            image.pixel_mut(x, y).fill(255);
            mask.pixel_mut(x, y)[0] = 0;
        }
    }
    write_png(&photo, &image).unwrap();
    let spoilt = json(&evaluate(&toy, &["--gaussians", "true.ply", "--json"]));
    assert!(spoilt["views"][0]["psnr"].as_f64().unwrap() < 30.0);
    write_png(&toy.path("mask.png"), &mask).unwrap();
    toy.capture.views[2].mask = Some("mask.png".into());
    motes_formats::capture::write_capture(&toy.path("capture.json"), &toy.capture).unwrap();
    let masked = json(&evaluate(&toy, &["--gaussians", "true.ply", "--json"]));
    assert_eq!(masked["views"][0]["psnr"], 128.0);
    assert_eq!(masked["views"][0]["counted_share"], 0.5);
}

#[test]
fn lpips_is_measured_with_the_users_weights() {
    let toy = toy_capture();
    write_changed(&toy, "changed.ply", 0.2);
    // AlexNet's shapes with few channels and arbitrary weights.
    let mut tensors = Vec::new();
    let mut add = |name: String, shape: Vec<usize>, scale: f32| {
        let n: usize = shape.iter().product();
        let values = (0..n).map(|i| scale * (i as f32 * 1.7).sin()).collect();
        tensors.push((name, TensorData::F32(shape, values)));
    };
    let layers = [(0, 3, 11), (3, 4, 5), (6, 4, 3), (8, 4, 3), (10, 4, 3)];
    for (k, (feature, inputs, kernel)) in layers.into_iter().enumerate() {
        add(format!("features.{feature}.weight"), vec![4, inputs, kernel, kernel], 0.3);
        add(format!("features.{feature}.bias"), vec![4], 0.1);
        add(format!("lin{k}.weight"), vec![1, 4, 1, 1], 0.0);
    }
    for (name, tensor) in &mut tensors {
        if let (true, TensorData::F32(_, values)) = (name.starts_with("lin"), tensor) {
            values.fill(0.5);
        }
    }
    let path = toy.path("alex.safetensors");
    write_tensors(&path, &tensors, &BTreeMap::new()).unwrap();
    let weights = ["--lpips-weights", "alex.safetensors", "--json", "--gaussians"];
    let equal = json(&evaluate(&toy, &[&weights[..], &["true.ply"]].concat()));
    assert_eq!(equal["lpips"], 0.0);
    assert_eq!(equal["protocol"]["lpips"]["network"], "alex");
    assert_eq!(equal["protocol"]["lpips"]["weights_sha256"].as_str().unwrap().len(), 64);
    let other = json(&evaluate(&toy, &[&weights[..], &["changed.ply"]].concat()));
    assert!(other["lpips"].as_f64().unwrap() > 1e-3, "{}", other["lpips"]);
    let wrong = evaluate(&toy, &[&weights[..], &["true.ply", "--lpips-net", "vgg"]].concat());
    assert_code(&wrong, 3);
    assert!(stderr(&wrong).contains("features.0.weight"), "{}", stderr(&wrong));
}

#[test]
fn bad_input_is_exit_code_3_and_named() {
    let toy = toy_capture();
    let output = evaluate(&toy, &["--gaussians", "none.ply"]);
    assert_code(&output, 3);
    assert!(stderr(&output).contains("none.ply"));
    write_png(&toy.path("images/view_5.png"), &ImageU8::filled(8, 8, 3, 0)).unwrap();
    let output = evaluate(&toy, &["--gaussians", "true.ply"]);
    assert_code(&output, 3);
    assert!(stderr(&output).contains("8x8") && stderr(&output).contains("view_5.png"));
    std::fs::write(toy.path("weights.safetensors"), b"not tensors").unwrap();
    let weights = ["--gaussians", "true.ply", "--lpips-weights", "weights.safetensors"];
    assert_code(&evaluate(&toy, &weights), 3);
}

#[test]
fn metrics_do_not_go_under_the_name_of_a_table() {
    let toy = toy_capture();
    let output = evaluate(&toy, &["--gaussians", "true.ply", "--metrics", "scores.csv"]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("end the name in .json"), "{}", stderr(&output));
    assert!(!toy.path("scores.csv").exists());
}
