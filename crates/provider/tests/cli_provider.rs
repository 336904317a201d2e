//! `provider check`: the program's findings and exit codes; the checks themselves are tested in `motes-protocol`.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::process::{Command, Output};

use serde_json::Value;

fn check(command: &str, more: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_provider"));
    program.args(["check", command, "--json"]).args(more).output().unwrap()
}

fn testdata(script: &str) -> String {
    format!("python3 '{}/../../testdata/providers/{script}'", env!("CARGO_MANIFEST_DIR"))
}

fn outcomes(done: &Output) -> Vec<Value> {
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    report["findings"].as_array().unwrap().clone()
}

#[test]
fn a_program_that_keeps_the_protocol_passes_and_the_findings_are_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("findings.json");
    let done = check(&testdata("copy.py"), &["--kind", "relight", "-o", file.to_str().unwrap()]);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    let printed = outcomes(&done);
    assert!(printed.len() >= 5);
    let kept: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    assert_eq!(kept["findings"].as_array().unwrap(), &printed);
    assert_eq!(kept["provider"]["name"], "copy");
}

#[test]
fn a_kind_that_the_program_does_not_answer_misses_the_gate() {
    let done = check(&testdata("copy.py"), &["--kind", "segment"]);
    assert_eq!(done.status.code(), Some(4));
    assert!(outcomes(&done).iter().any(|f| f["outcome"] == "failed"));
}

#[test]
fn a_program_that_says_nothing_misses_the_gate_and_none_at_all_is_bad_input() {
    assert_eq!(check("true", &["--kind", "relight"]).status.code(), Some(4));
    let done = check("there-is-no-such-program-here", &["--kind", "relight"]);
    assert_eq!(done.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&done.stderr).contains("there-is-no-such-program-here"));
}

#[test]
fn a_time_limit_of_nothing_is_a_usage_error() {
    let done = check(&testdata("copy.py"), &["--kind", "relight", "--time-limit", "0"]);
    assert_eq!(done.status.code(), Some(2));
}
