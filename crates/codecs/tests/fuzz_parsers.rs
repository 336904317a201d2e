//! Damaged files never make a parser panic, stall or take much memory.
//!
//! Stable, deterministic stand-in for the cargo-fuzz targets in `fuzz/`: both call the functions
//! of `fuzz/parsers.rs`. Every parser gets mutated files of the corpus for a part of a second;
//! `MOTES_FUZZ_SECONDS=600` gives it longer, `MOTES_FUZZ_SEED` another sequence. The input of a
//! failure is left in the folder of temporary files: add it to the corpus.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "shown with --nocapture")]

mod common;
#[path = "common/memory.rs"]
mod memory;
#[path = "common/mutate.rs"]
mod mutate;
#[path = "../fuzz/parsers.rs"]
mod parsers;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use common::{cases, corpus};
use motes_codecs::SplatFormat;
use mutate::Mutator;

const MAX_BYTES: usize = 200 << 20;
const MAX_SECONDS: f64 = 2.0;

fn setting(name: &str, default: f64) -> f64 {
    std::env::var(name).map_or(default, |text| text.parse().expect("a number"))
}

/// Feeds mutations of `seeds` to a parser until its time is over, at least a hundred of them.
fn fuzz(parser: &str, seeds: &[Vec<u8>], parse: impl Fn(&[u8])) {
    assert!(!seeds.is_empty(), "{parser} has no seeds");
    let time = Duration::from_secs_f64(setting("MOTES_FUZZ_SECONDS", 0.7));
    let mut mutator = Mutator::new(setting("MOTES_FUZZ_SEED", 1.0) as u64);
    let (started, mut runs, mut most) = (Instant::now(), 0, 0);
    while runs < 100 || started.elapsed() < time {
        let input = mutator.mutate(seeds);
        let one = Instant::now();
        let (outcome, bytes) =
            memory::peak_bytes_of(|| catch_unwind(AssertUnwindSafe(|| parse(&input))));
        let seconds = one.elapsed().as_secs_f64();
        most = most.max(bytes);
        if outcome.is_err() || bytes > MAX_BYTES || seconds > MAX_SECONDS {
            let file = std::env::temp_dir().join(format!("motes-fuzz-{parser}"));
            std::fs::write(&file, &input).unwrap();
            let what = if outcome.is_err() { "panicked" } else { "was slow or greedy" };
            let file = file.display();
            panic!("{parser} {what}: {bytes} bytes, {seconds:.2} s, run {runs}, input {file}");
        }
        runs += 1;
    }
    println!("{parser}: {runs} inputs, at most {most} bytes");
}

/// Files of the corpus that are small enough to be mutated often.
fn seeds(document: &str) -> Vec<Vec<u8>> {
    let paths = ["valid", "invalid"].into_iter().flat_map(|kind| cases(document, kind));
    let files = paths.map(|path| std::fs::read(path).unwrap());
    files.filter(|bytes| bytes.len() < 10_000).collect()
}

/// A copy of a valid COLMAP model.
fn model(from: &Path, to: &Path) -> Vec<Vec<u8>> {
    std::fs::create_dir_all(to).unwrap();
    let entries = std::fs::read_dir(from).unwrap().map(|entry| entry.unwrap().path());
    let files: Vec<PathBuf> = entries.filter(|path| path.is_file()).collect();
    let copy = |path: PathBuf| {
        std::fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
        std::fs::read(path).unwrap()
    };
    files.into_iter().map(copy).collect()
}

// One test only: the allocator counts for the whole process.
#[test]
fn parsers_survive_damaged_files() {
    fuzz("gaussians", &seeds("gaussians-ply"), parsers::gaussians);
    for (document, format) in [
        ("compressed-ply", SplatFormat::CompressedPly),
        ("splat", SplatFormat::Splat),
        ("spz", SplatFormat::Spz),
        ("sog", SplatFormat::Sog),
        ("ksplat", SplatFormat::Ksplat),
        ("gltf", SplatFormat::Glb),
    ] {
        fuzz(document, &seeds(document), |bytes| parsers::splats(format, bytes));
    }
    fuzz("points", &seeds("points-ply"), parsers::points);
    fuzz("surface", &seeds("surface-ply"), parsers::surface);
    fuzz("environment", &seeds("environment"), parsers::environment);
    fuzz("decomposition", &seeds("decomposition"), parsers::decomposition);
    fuzz("capture", &seeds("capture"), parsers::capture);
    fuzz("camera_path", &seeds("camera-path"), parsers::camera_path);
    fuzz("reports", &[seeds("metrics"), seeds("run")].concat(), parsers::reports);
    fuzz("image", &seeds("images"), parsers::image);
    let mut exr_seeds = seeds("exr-aov");
    exr_seeds.push(compressed_exr());
    fuzz("exr", &exr_seeds, parsers::exr);
    fuzz("tensor_file", &seeds("tensors"), parsers::tensor_file);

    let dir = tempfile::tempdir().unwrap();
    let models = corpus().join("../colmap/valid");
    for (name, suffix) in [("pycolmap-4-binary", "bin"), ("text", "txt")] {
        let folder = dir.path().join(name);
        let seeds = model(&models.join(name), &folder);
        let parse = |bytes: &[u8]| parsers::colmap_file(bytes, &folder, suffix);
        fuzz(&format!("colmap_{suffix}"), &seeds, parse);
    }
    let scratch = dir.path().join("transforms.json");
    let parse = |bytes: &[u8]| parsers::transforms_file(bytes, &scratch);
    fuzz("transforms_file", &[TRANSFORMS.as_bytes().to_vec()], parse);
}

/// What the writer makes: the corpus has only uncompressed files.
fn compressed_exr() -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let values: Vec<f32> = (0..40 * 30).map(|i| (i % 97) as f32).collect();
    let channels = [
        motes_formats::exr_aov::AovChannel::half("R", &values),
        motes_formats::exr_aov::AovChannel::float("depth.Z", values),
    ];
    motes_formats::exr_aov::write_exr(&path, 40, 30, &channels, &[]).unwrap();
    std::fs::read(path).unwrap()
}

const TRANSFORMS: &str = r#"{
  "camera_model": "OPENCV", "w": 640, "h": 480, "fl_x": 500.5, "fl_y": 500, "cx": 320, "cy": 240,
  "k1": 0.1, "k2": -0.01, "p1": 0, "p2": 0, "ply_file_path": "sparse.ply",
  "applied_transform": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]],
  "train_filenames": ["images/a.png"], "test_filenames": ["images/b.png"],
  "frames": [
    {"file_path": "images/a.png", "transform_matrix": [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]},
    {"file_path": "images/b.png", "mask_path": "m/b.png", "w": 64,
     "transform_matrix": [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}
  ]
}"#;
