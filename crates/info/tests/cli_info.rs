//! `info`: what it says about files of every kind.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use motes_codecs::{SplatFormat, SplatWriteOptions, write_gaussians};
use serde_json::{Value, json};

fn info(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_info"));
    command.args(arguments).current_dir(folder).output().unwrap()
}

fn testdata(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata").join(path)
}

/// The one description that `--json` prints.
fn described(path: &Path) -> Value {
    let done = info(Path::new("."), &[path.to_str().unwrap(), "--json"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(report["files"].as_array().unwrap().len(), 1);
    report["files"][0].clone()
}

#[test]
fn splats_of_every_format_have_their_counts_and_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let gaussians = motes_testkit::random_gaussians(3, 40, 1);
    let smallest_x = gaussians.means.iter().map(|p| p[0]).fold(f32::INFINITY, f32::min);
    let readable =
        SplatFormat::ALL.iter().filter(|f| f.codec().is_readable() && f.codec().is_writable());
    let mut seen = 0;
    for format in readable {
        let codec = format.codec();
        let path = folder.path().join(format!("a{}", codec.suffixes[0]));
        write_gaussians(&path, *format, &gaussians, &SplatWriteOptions::default()).unwrap();
        let found = described(&path);
        assert_eq!(
            (&found["kind"], &found["counts"]["gaussians"]),
            (&json!("gaussians"), &json!(40))
        );
        assert_eq!(found["format"], codec.name, "{found}");
        assert_eq!(found["sh_degree"], 1.min(codec.max_sh_degree), "{found}");
        let x = found["bounds"]["min"][0].as_f64().unwrap();
        assert!((x - f64::from(smallest_x)).abs() < 0.05, "{}: {x} {smallest_x}", codec.name);
        seen += 1;
    }
    assert!(seen >= 6, "{seen} formats");
}

#[test]
fn kinds_are_told_apart_by_what_is_in_the_file() {
    for (path, kind, count) in [
        ("meshes/cone.ply", "mesh", ("triangles", 96)),
        ("captures/tiny", "colmap-model", ("views", 9)),
        ("captures/tiny/sparse/0/cameras.txt", "colmap-model", ("points", 400)),
        ("formats/capture/v1/valid/full.json", "capture", ("views", 2)),
        ("formats/edit-plan/v1/valid/plain.json", "edit-plan", ("ops", 6)),
        ("formats/camera-path/v1/valid/plain.json", "camera-path", ("poses", 2)),
        ("formats/metrics/v1/valid/plain.json", "metrics", ("gaussians", 1000)),
        ("formats/run/v1/valid/plain.json", "run-record", ("inputs", 1)),
        ("formats/exr-aov/v1/valid/layers.exr", "channels", ("channels", 6)),
        ("formats/tensors/v1/valid/two.safetensors", "tensors", ("tensors", 2)),
        ("formats/meshes/v1/valid/mesh.glb", "model", ("meshes", 1)),
        ("formats/gltf/v1/valid/same-binary.glb", "gaussians", ("gaussians", 5)),
    ] {
        let found = described(&testdata(path));
        assert_eq!(found["kind"], kind, "{path}: {found}");
        assert_eq!(found["counts"][count.0], count.1, "{path}: {found}");
    }
    let folder = tempfile::tempdir().unwrap();
    let notes = folder.path().join("notes.txt");
    std::fs::write(&notes, "hello").unwrap();
    assert_eq!(described(&notes)["kind"], "unknown");
}

#[test]
fn who_made_a_file_stands_in_it_or_in_the_record_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("g.ply");
    let mut gaussians = motes_testkit::random_gaussians(3, 5, 0);
    gaussians.sh[1] = f32::NAN;
    motes_testkit::write_broken_gaussians(&path, &gaussians);
    let bare = described(&path);
    assert_eq!((&bare["non_finite"], &bare["made_by"]), (&json!(1), &Value::Null));
    assert!(bare["warnings"][0].as_str().unwrap().contains("the first is row 0"), "{bare}");
    std::fs::copy(
        testdata("formats/run/v1/valid/plain.json"),
        folder.path().join("g.ply.run.json"),
    )
    .unwrap();
    let recorded = described(&path);
    assert_eq!(recorded["made_by"], "train-splat 0.1.0");
    assert_eq!(recorded["seed"], 7);
}

#[test]
fn text_is_data_and_a_broken_file_is_the_error_of_its_reader() {
    let folder = tempfile::tempdir().unwrap();
    let cone = testdata("meshes/cone.ply");
    let done = info(folder.path(), &[cone.to_str().unwrap()]);
    let text = String::from_utf8(done.stdout).unwrap();
    assert!(text.contains("\n  mesh, ply, 2,060 bytes\n  triangles  96\n"), "{text}");
    assert_eq!(String::from_utf8_lossy(&done.stderr), "");

    std::fs::write(folder.path().join("cut.ply"), "ply\nformat ascii 1.0\nelement ver").unwrap();
    let broken = info(folder.path(), &[cone.to_str().unwrap(), "cut.ply"]);
    assert_eq!((broken.status.code(), broken.stdout.len()), (Some(3), 0));
    assert!(String::from_utf8_lossy(&broken.stderr).contains("cut.ply"));

    let written = info(folder.path(), &[cone.to_str().unwrap(), "-o", "info.json"]);
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    let json: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("info.json")).unwrap()).unwrap();
    assert_eq!(json["files"][0]["counts"]["triangles"], 96);
}
