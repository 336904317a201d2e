//! Gaussians from standard input and to standard output.

use std::io::Write as _;
use std::process::Stdio;

use super::*;

/// The program with `input` at its standard input.
fn piped(toy: &ToyScene, input: &[u8], arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_edit"));
    command.current_dir(toy.folder.path()).args(arguments);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    // A stage that refuses its line does not read.
    let _ = child.stdin.take().unwrap().write_all(input);
    child.wait_with_output().unwrap()
}

#[test]
fn a_pipe_gives_and_takes_the_bytes_of_a_file() {
    let toy = toy_scene();
    let bytes = std::fs::read(toy.path("scene/gaussians.ply")).unwrap();
    let step = ["--select", BOX_STEP, "--delete"];
    let line = [&["--gaussians", "scene/gaussians.ply"], &step[..], &["-o", "f.ply"]].concat();
    assert_code(&edit(&toy, &line), 0);
    let done = piped(&toy, &bytes, &[&["-"], &step[..], &["-o", "-"]].concat());
    assert_code(&done, 0);
    assert_eq!(done.stdout.len(), std::fs::read(toy.path("f.ply")).unwrap().len());
    std::fs::write(toy.path("p.ply"), &done.stdout).unwrap();
    let gaussians = |name: &str| read_gaussians(&toy.path(name)).unwrap();
    assert_eq!(gaussians("p.ply"), gaussians("f.ply"));
    assert!(!toy.path("-").exists() && !toy.path("-.edit-log.json").exists());
}

#[test]
fn a_pipe_has_no_selections_and_no_second_product() {
    let toy = toy_scene();
    let bytes = std::fs::read(toy.path("scene/gaussians.ply")).unwrap();
    let done = piped(&toy, &bytes, &["-", "--drop-nan", "-o", "-", "--json"]);
    assert_code(&done, 2);
    let selections = toy.path("s.json");
    std::fs::write(&selections, "{}").unwrap();
    let done = piped(&toy, &bytes, &["-", "--selection", "s.json", "--delete", "-o", "x.ply"]);
    assert_code(&done, 3);
    assert!(text(&done).contains("these come from standard input"), "{}", text(&done));
    assert_code(&piped(&toy, b"not a splat", &["-", "--drop-nan", "-o", "-"]), 3);
}
