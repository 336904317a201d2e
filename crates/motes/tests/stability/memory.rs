//! Too little memory is said before the work, with the remedy.

use super::bench::{Bench, RENDER, TRAIN, clear_error, text};

/// Address space in KiB that the program itself and two threads with their arenas need.
const ROOM: &str = "ulimit -v 1500000";

#[test]
fn a_fit_that_does_not_fit_is_refused_beforehand() {
    let bench = Bench::with_capture();
    let line = ["--capture", "cap/capture.json", "-o", "out.ply", "-q", "-j2", "-n=3"];
    let output =
        bench.run_limited(ROOM, TRAIN, &[&line[..], &["--max-gaussians", "2000000"]].concat());
    clear_error(&output, &["GiB of memory", "help:", "--max-gaussians"]);
    assert!(!bench.path("out.ply").exists());
    let output =
        bench.run_limited(ROOM, TRAIN, &[&line[..], &["--max-gaussians", "2000"]].concat());
    assert!(output.status.success(), "a small fit has room: {}", text(&output));
}

#[test]
fn a_picture_that_does_not_fit_is_refused_beforehand() {
    let bench = Bench::with_fit();
    let line = ["--capture", "cap/capture.json", "--gaussians", "g.ply", "-o", "r", "-q", "-j2"];
    let view = ["--view", "view_01.png", "--width"];
    let size = |width| [&line[..], &view, &[width]].concat();
    let output = bench.run_limited(ROOM, RENDER, &size("32768"));
    clear_error(&output, &["GiB of memory", "help:", "--width"]);
    assert!(!bench.path("r").exists(), "nothing is left");
    let output = bench.run_limited(ROOM, RENDER, &size("200"));
    assert!(output.status.success(), "{}", text(&output));
}
