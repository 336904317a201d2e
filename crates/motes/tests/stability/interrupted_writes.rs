//! A full disk and a killed program: whole files or none.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use motes_formats::ply::read_gaussians;

use super::bench::{Bench, EVALUATE, IMPORT, RENDER, REPORT, TRAIN, clear_error, tiny};

/// Files above this many blocks of 1024 bytes cannot be written; the write fails like on a full disk.
const FULL: &str = "trap '' XFSZ; ulimit -f 1";

/// Every file below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => found.push(path),
        }
    }
    found
}

const CAPTURE: [&str; 3] = ["--capture", "cap/capture.json", "-q"];

#[test]
fn a_full_disk_is_one_clear_error_and_no_half_product() {
    let bench = Bench::with_fit();
    let tiny = tiny();
    let fit = [&CAPTURE[..], &["-n=5", "-o", "full.ply"]].concat();
    let model = [&CAPTURE[..], &["--gaussians", "g.ply"]].concat();
    let render = [&model[..], &["--split", "test", "-o", "full-r", "--format", "exr"]].concat();
    let page = [&model[..], &["--report", "full.html", "--metrics", "full.json"]].concat();
    let import = [tiny.to_str().unwrap(), "-o", "full-cap", "-q"];
    for (program, line, products) in [
        (TRAIN, &fit[..], &["full.ply"][..]),
        (RENDER, &render, &["full-r"]),
        (EVALUATE, &page, &["full.html"]),
        (IMPORT, &import, &["full-cap/capture.json"]),
    ] {
        let before = files(bench.folder.path()).len();
        let output = bench.run_limited(FULL, program, line);
        clear_error(&output, &["File too large"]);
        for product in products {
            let whole = bench.path(product);
            assert!(files(&whole).is_empty() && !whole.is_file(), "{product}");
        }
        let left = files(bench.folder.path());
        let temporary = |p: &&PathBuf| p.to_string_lossy().contains(".motes-");
        assert_eq!(left.iter().find(temporary), None, "a temporary file is left");
        assert!(left.len() < before + 12, "{left:?}");
    }
}

#[test]
fn a_device_without_room_is_one_clear_error() {
    let bench = Bench::with_fit();
    let model = [&CAPTURE[..], &["--gaussians", "g.ply"]].concat();
    let run = [&CAPTURE[..], &["-n=2", "-o", "/dev/full"]].concat();
    clear_error(&bench.run(TRAIN, &run), &["No space left", "/dev/full"]);
    let run = [&model[..], &["--metrics", "/dev/full"]].concat();
    clear_error(&bench.run(EVALUATE, &run), &["No space left", "/dev/full"]);
    let run = [&CAPTURE[..], &["-n=2", "-o", "m.ply", "--metrics", "/dev/full"]].concat();
    clear_error(&bench.run(TRAIN, &run), &["No space left", "/dev/full"]);
    clear_error(
        &bench.run(REPORT, &["lab", "cap", "-o", "/dev/full", "-q"]),
        &["motes report lab"],
    );
}

/// Kills the program at moments spread over its run; the product is whole or absent, and a run that
/// is left alone works.
fn kill_at_all_moments(bench: &Bench, program: &str, line: &[&str], check: impl Fn()) {
    for moment in 0..12u64 {
        let mut child = bench.command(program, line).spawn().unwrap();
        std::thread::sleep(Duration::from_micros(500 + 9_000 * moment + 1_700 * (moment % 3)));
        child.kill().unwrap();
        child.wait().unwrap();
        check();
    }
    bench.ok(program, line);
    check();
}

#[test]
fn a_killed_fit_leaves_a_whole_file_or_none() {
    let bench = Bench::with_capture();
    let line = [
        &CAPTURE[..],
        &["-o", "k.ply", "-n=12", "--save-every", "1", "--overwrite", "--max-gaussians", "3000"],
    ]
    .concat();
    let product = bench.path("k.ply");
    kill_at_all_moments(&bench, TRAIN, &line, || {
        if product.exists() {
            let g = read_gaussians(&product).unwrap();
            assert!(g.is_consistent() && !g.is_empty());
        }
        // A checkpoint that is there continues.
        if bench.path("k.checkpoint.safetensors").exists() {
            let resume = ["-o", "r.ply", "--overwrite", "--resume", "k.checkpoint.safetensors"];
            bench.ok(TRAIN, &[&CAPTURE[..], &resume].concat());
        }
    });
}

#[test]
fn a_killed_import_leaves_no_capture_or_a_whole_one() {
    let bench = Bench::new();
    let model = tiny();
    let line = [model.to_str().unwrap(), "-o", "cap", "-q", "--overwrite"];
    let document = bench.path("cap/capture.json");
    kill_at_all_moments(&bench, IMPORT, &line, || {
        if document.exists() {
            let capture = motes_formats::capture::read_capture(&document).unwrap();
            assert_eq!((capture.views.len(), capture.points.len()), (9, 400));
            for view in &capture.views {
                motes_formats::images::read_image(&bench.path("cap").join(&view.image)).unwrap();
            }
        }
    });
}

#[test]
fn a_killed_renderer_leaves_whole_pictures() {
    let bench = Bench::with_fit();
    let line = [
        &CAPTURE[..],
        &["--gaussians", "g.ply", "--split", "all", "-o", "r", "--overwrite", "--width", "300"],
    ]
    .concat();
    kill_at_all_moments(&bench, RENDER, &line, || {
        for path in files(&bench.path("r")) {
            let name = path.file_name().unwrap().to_string_lossy();
            if name.ends_with(".png") && !name.starts_with(".motes-") {
                motes_formats::images::read_image(&path).unwrap();
            }
        }
    });
}
