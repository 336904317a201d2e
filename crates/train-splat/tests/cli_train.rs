//! `train-splat` as a program: bytes over threads, resume, interruption, bad input; and the chain
//! from a COLMAP model to a score on the tiny capture of `testdata`.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use motes_formats::documents::read_document;
use motes_formats::train_report::TrainReportDocument;
use motes_testkit::made_photos::{self, MadePhoto};
use serde_json::Value;

const TRAIN: &str = "train-splat";
const IMPORT: &str = "import-colmap";
const EVALUATE: &str = "evaluate";

fn tiny() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/captures/tiny")
}

fn run(program: &str, arguments: &[&str], folder: &Path) -> Output {
    Command::new(motes_testkit::program(program))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .env_remove("MOTES_THREADS")
        .output()
        .unwrap()
}

fn ok(output: &Output) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{:?}: {text}", output.status);
}

/// A folder with `cap/capture.json` of the tiny capture; views 0 and 8 are held out.
fn imported() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let model = tiny();
    let line = [model.to_str().unwrap(), "-o", "cap", "--test-every", "8", "-q"];
    ok(&run(IMPORT, &line, folder.path()));
    folder
}

const SHORT: [&str; 7] = [
    "--capture",
    "cap/capture.json",
    "--no-provenance",
    "-q",
    "--max-gaussians",
    "1500",
    "--refine-every=30",
];

/// Trains for 120 steps, or as many as `extra` says.
fn train(folder: &Path, extra: &[&str]) -> Output {
    let steps: &[&str] = if extra.iter().any(|a| a.starts_with("-n=")) { &[] } else { &["-n=120"] };
    run(TRAIN, &[&SHORT[..], steps, extra].concat(), folder)
}

#[test]
fn the_chain_reaches_a_useful_score() {
    let folder = imported();
    let before = evaluate_points(folder.path());
    ok(&train(folder.path(), &["-o", "g.ply", "-n=600", "--metrics", "train.json"][..]));
    let score = evaluate(folder.path(), "g.ply");
    let psnr = score["psnr"].as_f64().unwrap();
    assert!(psnr > 20.0 && psnr > before + 3.0, "{before:.2} -> {psnr:.2} dB");
    let report: Value =
        serde_json::from_slice(&fs::read(folder.path().join("train.json")).unwrap()).unwrap();
    assert_eq!(report["format"], "motes/train-report");
    // What the writer says is what the format says, key by key.
    let read = read_document::<TrainReportDocument>(&folder.path().join("train.json")).unwrap();
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
    assert_eq!(serde_json::to_value(&read.document).unwrap(), report);
    // Two programs, one protocol: the trainer's own score is the evaluator's.
    assert!((report["psnr_test"].as_f64().unwrap() - psnr).abs() < 1e-6);
    assert!(!report["history"].as_array().unwrap().is_empty());
}

fn evaluate(folder: &Path, gaussians: &str) -> Value {
    let line =
        ["--capture", "cap/capture.json", "--gaussians", gaussians, "--json", "--no-provenance"];
    let output = run(EVALUATE, &line, folder);
    ok(&output);
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Score of the start alone: one step.
fn evaluate_points(folder: &Path) -> f64 {
    ok(&train(folder, &["-o", "start.ply", "-n=1"]));
    evaluate(folder, "start.ply")["psnr"].as_f64().unwrap()
}

#[test]
fn the_bytes_depend_on_the_seed_alone() {
    let folder = imported();
    let bytes = |name: &str, threads: &str, seed: &str| {
        ok(&train(folder.path(), &["-o", name, "-j", threads, "--seed", seed]));
        fs::read(folder.path().join(name)).unwrap()
    };
    let one = bytes("1.ply", "1", "3");
    assert!(bytes("2.ply", "2", "3") == one && bytes("3.ply", "3", "3") == one);
    assert!(bytes("other.ply", "2", "4") != one);
}

fn wait_for(file: &Path) {
    let patience = Instant::now();
    while !file.exists() && patience.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_killed_run_continues_to_the_same_bytes() {
    let folder = imported();
    let path = |name: &str| folder.path().join(name);
    ok(&train(folder.path(), &["-o", "whole.ply"]));
    // Killed without warning, some time after its first checkpoint.
    let mut child = Command::new(motes_testkit::program(TRAIN))
        .args(SHORT)
        .args(["-o", "half.ply", "-n=120", "--save-every", "10"])
        .current_dir(folder.path())
        .spawn()
        .unwrap();
    wait_for(&path("half.checkpoint.safetensors"));
    child.kill().unwrap();
    child.wait().unwrap();
    let line = ["-o", "resumed.ply", "--resume", "half.checkpoint.safetensors"];
    ok(&train(folder.path(), &line));
    assert!(fs::read(path("resumed.ply")).unwrap() == fs::read(path("whole.ply")).unwrap());
}

#[cfg(unix)]
#[test]
fn an_interrupt_saves_a_checkpoint_and_says_130() {
    let folder = imported();
    let child = Command::new(motes_testkit::program(TRAIN))
        .args(SHORT)
        .args(["-o", "long.ply", "-n=100000", "--save-every=5"])
        .current_dir(folder.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Its first checkpoint says that it is under way; the next periodic one is never awaited.
    let checkpoint = folder.path().join("long.checkpoint.safetensors");
    wait_for(&checkpoint);
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("--resume"), "{text}");
    assert!(checkpoint.exists());
    assert!(!folder.path().join("long.ply").exists());
}

#[test]
fn a_time_budget_is_kept_with_loading_scoring_and_writing() {
    let folder = imported();
    for seconds in ["1", "4"] {
        let asked: f64 = seconds.parse().unwrap();
        let start = Instant::now();
        let line = ["--capture", "cap/capture.json", "-q", "--overwrite", "-o", "timed.ply"];
        ok(&run(TRAIN, &[&line[..], &["--time-budget", seconds]].concat(), folder.path()));
        let taken = start.elapsed().as_secs_f64();
        // A tenth is promised; starting a process on a busy machine gets the rest.
        assert!(taken > 0.85 * asked && taken < 1.15 * asked + 0.3, "{asked} s: {taken:.2} s");
        let model = motes_formats::ply::read_gaussians(&folder.path().join("timed.ply")).unwrap();
        assert!(!model.is_empty() && model.invalid_rows().is_empty());
    }
}

#[test]
fn a_target_stops_the_run_and_a_missed_one_is_said() {
    let folder = imported();
    let report = |target: &str| -> Value {
        let line = ["-o", "t.ply", "--overwrite", "--json", "--target", target];
        let output = train(folder.path(), &line);
        ok(&output);
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let reached = report("psnr=5");
    assert_eq!(reached["target"]["reached"], true);
    assert!(reached["iterations"].as_u64().unwrap() < 120, "{reached}");
    assert!(reached["psnr_test"].as_f64().unwrap() >= 5.0);
    let missed = report("psnr=70");
    assert_eq!(missed["target"]["reached"], false);
    assert_eq!(
        (missed["iterations"].as_u64(), missed["complete"].as_bool()),
        (Some(120), Some(true))
    );
    assert_eq!(missed["target"]["set_aside"], false);
}

#[test]
fn without_test_photos_a_target_sets_training_photos_aside() {
    let folder = tempfile::tempdir().unwrap();
    let model = tiny();
    ok(&run(IMPORT, &[model.to_str().unwrap(), "-o", "cap", "-q"], folder.path()));
    let output = train(folder.path(), &["-o", "t.ply", "--target", "psnr=70", "--json", "-n=20"]);
    ok(&output);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["target"]["set_aside"], true);
    let (train_views, test_views) = (&report["train_views"], &report["test_views"]);
    assert!(test_views.as_u64().unwrap() >= 1 && train_views.as_u64().unwrap() >= 1, "{report}");
}

#[test]
fn a_profile_accounts_for_the_time() {
    let folder = imported();
    let output = train(folder.path(), &["-o", "p.ply", "--profile", "--json"]);
    ok(&output);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let profile = &report["profile"];
    let phases = profile["phases"].as_array().unwrap();
    let wall: f64 = phases.iter().map(|p| p["wall_s"].as_f64().unwrap()).sum();
    let (whole, other) =
        (report["seconds"].as_f64().unwrap(), profile["other_wall_s"].as_f64().unwrap());
    assert!((wall + other - whole).abs() < 0.02 * whole + 0.02, "{wall} + {other} of {whole}");
    assert!(other < 0.5 * whole, "{profile}");
    assert_eq!(profile["counts"]["steps"], 120);
    assert!(profile["units"]["forward_per_pair_ns"].as_f64().unwrap() > 0.0);
    assert!(profile["units"]["visited_per_composited"].as_f64().unwrap() >= 1.0);
}

#[test]
fn a_warm_start_keeps_what_is_frozen() {
    let folder = imported();
    ok(&train(folder.path(), &["-o", "g.ply"]));
    let line = ["-o", "same.ply", "--init-ply", "g.ply", "-n=1", "--filter-3d", "off"];
    let freeze = ["--freeze", "geometry,opacities,colors", "--sh-degree", "3"];
    ok(&train(folder.path(), &[&line[..], &freeze].concat()));
    let read = |name: &str| motes_formats::ply::read_gaussians(&folder.path().join(name)).unwrap();
    assert_eq!(read("g.ply").means, read("same.ply").means);
    assert_eq!(read("g.ply").log_scales, read("same.ply").log_scales);
}

#[test]
fn bad_input_is_one_clear_error() {
    let folder = imported();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    write("no.safetensors", b"\x08\0\0\0\0\0\0\0{}      ");
    write("short.safetensors", b"\xff\xff\xff\xff\xff\xff\xff\x7f{");
    write("cap/images.txt", b"");
    for (line, code, word) in [
        (&["-o", "x.ply", "--resume", "no.safetensors"][..], 3, "checkpoint"),
        (&["-o", "x.ply", "--resume", "short.safetensors"], 3, "short.safetensors"),
        (&["-o", "x.ply", "--resume", "missing"], 3, "missing"),
        (&["-o", "x.ply", "--init-ply", "cap/capture.json"], 3, "capture.json"),
        (&["-o", "x.ply", "--resolution-schedule", "2:1"], 2, "--resolution-schedule"),
        (&["-o", "x.ply", "--sh-degree", "5"], 2, "sh-degree"),
        (&["-o", "x.ply", "--target", "ssim=1"], 2, "psnr=NUMBER"),
    ] {
        let output = train(folder.path(), line);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{line:?}: {text}");
        assert!(text.contains(word), "{line:?}: {text}");
        assert!(!folder.path().join("x.ply").exists(), "{line:?}");
    }
}

/// A folder with `cap/capture.json` of these photos.
fn made(photos: &[MadePhoto]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("cap")).unwrap();
    made_photos::write(&folder.path().join("cap"), photos).unwrap();
    folder
}

/// The report of a run, with its exit code and what it said.
fn judged(photos: &[MadePhoto], extra: &[&str]) -> (Value, Option<i32>, String) {
    let folder = made(photos);
    let output = train(folder.path(), &[&["-o", "g.ply", "--metrics", "m.json"], extra].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(folder.path().join("g.ply").exists(), "the model is there to be looked at: {said}");
    let report = fs::read(folder.path().join("m.json")).unwrap();
    (serde_json::from_slice(&report).unwrap(), output.status.code(), said)
}

#[test]
fn a_fit_that_fails_says_why_and_ends_with_4() {
    let photos = made_photos::ring_around_object(32);
    let (report, code, said) = judged(&photos, &["-n=300"]);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(report["verdict"]["start"], "photos");
    assert_eq!(report["verdict"]["failure"], Value::Null);
    assert!(report["verdict"]["poses"]["agreeing"].as_u64().unwrap() > 100);

    let (report, code, said) = judged(&made_photos::shuffled(photos.clone()), &["-n=300"]);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("the poses contradict the photos"), "{said}");
    assert!(report["verdict"]["failure"].is_string(), "{}", report["verdict"]);

    let (report, code, said) = judged(&made_photos::blank(photos), &["-n=300"]);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("blank photos"), "{said}");
    // The photos said nothing, and random Gaussians did not help either.
    assert_eq!(report["verdict"]["failed_starts"], serde_json::json!(["photos"]));
}

#[test]
fn flags_that_a_checkpoint_contradicts_are_refused_and_a_dry_run_says_the_numbers() {
    let folder = imported();
    ok(&train(folder.path(), &["-n=2", "-o", "k.ply", "--save-every", "1"]));
    let line = ["-o", "r.ply", "--resume", "k.checkpoint.safetensors"];
    let output = train(folder.path(), &[&line[..], &["-n=9", "--seed", "5"]].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    for words in ["--iterations is 9 here and 2 there", "--seed is 5 here", "--init-ply"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(!folder.path().join("r.ply").exists());
    let line = ["-o", "d.ply", "--preset", "draft", "-n=7", "--dry-run", "--json"];
    let output = train(folder.path(), &line);
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(said["report"]["iterations"], 7, "{said}");
    assert_eq!(said["report"]["max_gaussians"], 1500, "{said}");
}

#[test]
fn a_checkpoint_that_was_changed_or_is_not_finite_is_refused() {
    let folder = imported();
    let path = |name: &str| folder.path().join(name);
    ok(&train(folder.path(), &["-n=2", "-o", "k.ply", "--save-every", "1"]));
    let whole = fs::read(path("k.checkpoint.safetensors")).unwrap();
    let resume = |extra: &[&str]| {
        let line = ["-n=3", "-o", "r.ply", "-w", "--resume", "changed.safetensors"];
        let output = train(folder.path(), &[&line[..], extra].concat());
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    // One value becomes NaN: in a file with a checksum, and in one of version 3.0, which has none.
    let mut changed = whole.clone();
    let end = changed.len();
    changed[end - 4000..end - 3996].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(path("changed.safetensors"), &changed).unwrap();
    let (code, said) = resume(&[]);
    assert!(code == Some(3) && said.contains("changed after it was written"), "{code:?} {said}");
    let (mut tensors, mut metadata) =
        motes_formats::tensors::read_tensors(&path("k.checkpoint.safetensors")).unwrap();
    metadata.remove("checksum").unwrap();
    metadata.insert("version".into(), "3.0".into());
    let Some(motes_formats::tensors::TensorData::F32(_, means)) = tensors.get_mut("means") else {
        panic!("no means");
    };
    means[7] = f32::NAN;
    let tensors: Vec<_> = tensors.into_iter().collect();
    let file = path("changed.safetensors");
    motes_formats::tensors::write_tensors(&file, &tensors, &metadata).unwrap();
    let (code, said) = resume(&[]);
    assert!(code == Some(3) && said.contains("not finite"), "{code:?} {said}");
    assert!(!path("r.ply").exists());
}

#[test]
fn a_fit_that_diverges_is_no_product() {
    let folder = imported();
    fs::write(folder.path().join("c.json"), r#"{"lr_means": 1e38, "lr_sh0": 1e38}"#).unwrap();
    let output = train(folder.path(), &["-n=5", "-o", "d.ply", "--config", "c.json"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() {
        let model = motes_formats::ply::read_gaussians(&folder.path().join("d.ply")).unwrap();
        assert!(!model.is_empty() && model.invalid_rows().is_empty());
    } else {
        assert!(!folder.path().join("d.ply").exists() && !said.contains("panicked"), "{said}");
    }
}

#[test]
fn a_world_beyond_single_precision_is_refused() {
    for scale in [1e-20, 1e30] {
        let mut photos = made_photos::walk(3);
        for photo in &mut photos {
            photo.camera_from_world.translation *= scale;
        }
        let folder = made(&photos);
        let output = train(folder.path(), &["-o", "g.ply"]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{scale:e}: {said}");
        assert!(said.contains("the cameras span") && said.contains("1e9 units"), "{said}");
    }
}
