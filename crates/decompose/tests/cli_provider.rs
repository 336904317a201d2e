//! `decompose --provider`: predictions of a program as priors, and what protects from them.

use std::process::Output;

use motes_testkit::toy_capture::{ToyCapture, assert_code, run, stderr, toy_capture};
use serde_json::Value;

const PROVIDER: &str =
    concat!("python3 ", env!("CARGO_MANIFEST_DIR"), "/../../testdata/providers/predict_even.py");

fn decompose(toy: &ToyCapture, arguments: &[&str]) -> Output {
    let mut all = vec!["--capture", "capture.json", "--gaussians", "true.ply", "--no-provenance"];
    all.extend(["--samples", "300", "--material-rays", "12", "--pixel-rays", "8", "--json"]);
    all.extend(["--photo-steps", "0", "--residual-steps", "0", "--refine-rounds", "0"]);
    all.extend(["--provider-cache", "answers"]);
    all.extend(arguments);
    run(env!("CARGO_BIN_EXE_decompose"), toy.folder.path(), &all)
}

#[test]
fn a_provider_predicts_and_is_named() {
    let toy = toy_capture();
    let done = decompose(&toy, &["--provider", PROVIDER, "-o", "scene"]);
    assert_code(&done, 0);
    assert!(!stderr(&done).contains("left out"), "{}", stderr(&done));
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(report["provider"]["name"], "predict-even", "{report}");
    let answered = report["provider"]["answered"].as_u64().unwrap();
    assert!(answered > 0);
    // Kept answers give the same scene without asking again.
    let again = decompose(&toy, &["--provider", PROVIDER, "-o", "again"]);
    assert_code(&again, 0);
    let report: Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(
        (&report["provider"]["answered"], &report["provider"]["kept"]),
        (&0.into(), &answered.into())
    );
    let bytes = |name: &str| std::fs::read(toy.path(name)).unwrap();
    assert_eq!(bytes("scene/gaussians.ply"), bytes("again/gaussians.ply"));
}

#[test]
fn base_colors_of_something_else_are_left_out() {
    let toy = toy_capture();
    let wrong = format!("{PROVIDER} --wrong");
    let line = ["--predict", "base-color", "-o", "wrong", "--provider", &wrong];
    let done = decompose(&toy, &line);
    assert_code(&done, 0);
    assert!(stderr(&done).contains("are left out"), "{}", stderr(&done));
    assert_code(&decompose(&toy, &["-o", "plain"]), 0);
    let bytes = |name: &str| std::fs::read(toy.path(name)).unwrap();
    assert_eq!(bytes("wrong/gaussians.ply"), bytes("plain/gaussians.ply"), "no harm is done");
}

#[test]
fn providers_are_named_by_the_command_line_and_once() {
    let toy = toy_capture();
    std::fs::write(toy.path("config.json"), format!("{{\"provider\": {PROVIDER:?}}}")).unwrap();
    for (arguments, code, said) in [
        (&["--config", "config.json"][..], 2, "provider"),
        (&["--provider", PROVIDER, "--prior-images", "."], 2, "give one of them"),
        (&["--provider", "no-such-provider-here"], 3, "no provider no-such-provider-here"),
        (&["--provider", "true"], 3, "does not keep the protocol"),
    ] {
        let done = decompose(&toy, &[arguments, &["-o", "scene"]].concat());
        assert_code(&done, code);
        assert!(stderr(&done).contains(said), "{said}: {}", stderr(&done));
        assert!(!toy.path("scene").exists());
    }
}
