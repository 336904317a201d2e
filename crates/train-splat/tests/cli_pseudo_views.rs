//! Pseudo-views: a provider's pictures of the gaps between photos enter the fit as far as they are trusted.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::process::Output;

use motes_testkit::toy_capture::{ToyCapture, assert_code, run, stderr, toy_capture};
use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_train-splat");

fn provider(options: &str) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/providers");
    format!("python3 '{folder}/novel_view.py' {options}")
}

fn train(toy: &ToyCapture, output: &str, extra: &[&str]) -> Output {
    let line = ["--capture", "capture.json", "--no-provenance", "-n=60", "-o", output];
    let colors_alone = ["--freeze", "geometry", "--model", "minimal"];
    run(PROGRAM, toy.folder.path(), &[&line[..], &colors_alone, extra].concat())
}

fn with_pseudo_views(toy: &ToyCapture, name: &str, options: &str, more: &[&str]) -> Value {
    let (output, metrics) = (format!("{name}.ply"), format!("{name}.json"));
    let command = provider(options);
    let words = ["--init-ply", "true.ply", "--pseudo-views", "3", "--provider-cache", "none"];
    let told = ["--provider", &command, "--metrics", &metrics];
    let done = train(toy, &output, &[&words[..], &told, more].concat());
    assert_code(&done, 0);
    let text = std::fs::read_to_string(toy.path(&metrics)).unwrap();
    let mut report: Value = serde_json::from_str(&text).unwrap();
    report["said"] = stderr(&done).into();
    report
}

fn bytes(toy: &ToyCapture, name: &str) -> Vec<u8> {
    std::fs::read(toy.path(name)).unwrap()
}

#[test]
fn pseudo_views_join_the_fit_and_the_report_says_whose_they_are() {
    let toy = toy_capture();
    let report = with_pseudo_views(&toy, "a", "", &["--pseudo-pictures", "made"]);
    let pseudo = &report["pseudo_views"];
    assert_eq!((pseudo["made"].as_u64(), pseudo["used"].as_u64()), (Some(3), Some(3)), "{pseudo}");
    assert_eq!(pseudo["weights"], serde_json::json!([1.0, 1.0, 1.0]));
    assert_eq!(pseudo["provider"]["name"], "novel-view");
    assert_eq!(std::fs::read_dir(toy.path("made")).unwrap().count(), 3);
    assert_code(&train(&toy, "none.ply", &["--init-ply", "true.ply", "--metrics", "n.json"]), 0);
    let plain: Value = serde_json::from_slice(&bytes(&toy, "n.json")).unwrap();
    assert_eq!(report["train_views"], plain["train_views"], "they are no photos");
    assert_eq!(plain.get("pseudo_views"), None);
    assert_ne!(bytes(&toy, "a.ply"), bytes(&toy, "none.ply"));
    with_pseudo_views(&toy, "b", "", &["--threads", "1"]);
    assert_eq!(bytes(&toy, "a.ply"), bytes(&toy, "b.ply"), "the same bits at any thread count");
}

#[test]
fn a_view_counts_as_far_as_it_is_trusted() {
    let toy = toy_capture();
    assert_code(&train(&toy, "none.ply", &["--init-ply", "true.ply"]), 0);
    let fitted = |confidence: &str| {
        let options = format!("--negative --confidence {confidence}");
        let report = with_pseudo_views(&toy, confidence, &options, &[]);
        (report["psnr_train"].as_f64().unwrap(), report)
    };
    let (none, report) = fitted("0.4");
    assert_eq!(report["pseudo_views"]["used"].as_u64(), Some(0));
    assert!(report["said"].as_str().unwrap().contains("3 of 3 pseudo-views are left out"));
    assert_eq!(bytes(&toy, "0.4.ply"), bytes(&toy, "none.ply"));
    let ((half, report), (whole, _)) = (fitted("0.5"), fitted("1"));
    assert_eq!(report["pseudo_views"]["weights"], serde_json::json!([0.5, 0.5, 0.5]));
    // Wrong pictures pull the model away from the photos: the more, the more they are trusted.
    assert!(none > half + 0.5 && half > whole + 0.5, "{none}, {half}, {whole} dB");
}

#[test]
fn flags_that_need_each_other_say_so() {
    let toy = toy_capture();
    let command = provider("");
    let init = ["--init-ply", "true.ply"];
    for (words, says) in [
        (vec!["--provider", &command, init[0], init[1]], "--pseudo-views 8"),
        (vec!["--pseudo-views", "3", init[0], init[1]], "--provider COMMAND"),
        (vec!["--pseudo-views", "3", "--provider", &command], "--init-ply"),
    ] {
        let done = train(&toy, "x.ply", &words);
        assert_code(&done, 2);
        assert!(stderr(&done).contains(says), "{}", stderr(&done));
    }
    let copy = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/providers/predict_even.py");
    let other = format!("python3 '{copy}'");
    let words = ["--pseudo-views", "3", "--provider", &other, init[0], init[1]];
    let done = train(&toy, "x.ply", &words);
    assert_code(&done, 3);
    assert!(stderr(&done).contains("does not do novel-view"), "{}", stderr(&done));
    assert!(!toy.path("x.ply").exists());
}
