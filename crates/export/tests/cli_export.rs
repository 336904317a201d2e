//! What only `export` does: formats by suffix, refusals, cameras that come back.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use motes_codecs::{CODECS, open_gaussians};
use motes_scene::Gaussians;
use serde_json::Value;

struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    /// A folder with `g.ply`.
    fn new() -> Self {
        let bench = Self { dir: tempfile::tempdir().unwrap() };
        bench.put("g.ply", &motes_testkit::random_gaussians(3, 200, 2));
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn put(&self, name: &str, gaussians: &Gaussians) {
        motes_testkit::write_broken_gaussians(&self.path(name), gaussians);
    }

    fn run(&self, program: &str, arguments: &[&str]) -> Output {
        let folder = Path::new(env!("CARGO_BIN_EXE_export")).parent().unwrap();
        let mut command = Command::new(folder.join(program));
        command.current_dir(self.dir.path()).args(arguments).output().unwrap()
    }

    #[track_caller]
    fn export(&self, arguments: &[&str]) -> Value {
        let output = self.run("export", &[arguments, &["--json"]].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {said}");
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// What it says when it fails, which leaves nothing behind.
    #[track_caller]
    fn refusal(&self, code: i32, arguments: &[&str]) -> String {
        let before = self.names();
        let output = self.run("export", arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert_eq!(self.names(), before, "{arguments:?} left something");
        said
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.dir.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

#[test]
fn every_format_is_written_and_the_readable_ones_verify() {
    let bench = Bench::new();
    for codec in CODECS.iter().filter(|codec| codec.is_writable()) {
        let name = format!("out{}", codec.suffixes[0]);
        let mut line = vec!["g.ply", "-o", name.as_str()];
        if codec.is_readable() {
            line.extend(["--verify", "--verify-views", "2"]);
        }
        let report = bench.export(&line);
        assert_eq!((&report["format"], &report["gaussians"]), (&codec.name.into(), &200.into()));
        assert!(report["bytes_per_gaussian"].as_f64().unwrap() > 5.0);
        if codec.is_readable() {
            // Degree 2 without its harmonics is another scene; what is lossy keeps 30 dB.
            let least = if codec.max_sh_degree == 0 { 8.0 } else { 30.0 };
            let psnr = report["verify"]["psnr_db"].as_f64();
            let enough = if codec.lossless { 100.0 } else { least };
            assert!(psnr.is_none_or(|psnr| psnr > enough), "{}: {psnr:?}", codec.name);
        }
    }
}

#[test]
fn a_stage_takes_what_export_wrote() {
    let bench = Bench::new();
    bench.export(&["g.ply", "-o", "g.spz"]);
    bench.export(&["g.ply", "-o", "g.sog"]);
    let again = bench.export(&["g.spz", "g.sog", "-o", "both.ply"]);
    assert_eq!(again["gaussians"], 400);
    assert_eq!(open_gaussians(&bench.path("both.ply")).unwrap().gaussians.len(), 400);
}

#[test]
fn the_flags_choose_layout_degree_and_rows() {
    let bench = Bench::new();
    bench.export(&["g.ply", "-o", "flat.ply", "--layout", "2dgs", "--sh-degree", "1"]);
    let text = fs::read(bench.path("flat.ply")).unwrap();
    let header = String::from_utf8_lossy(&text[..2000]).into_owned();
    assert!(header.contains("scale_1") && !header.contains("scale_2"), "{header}");
    assert!(header.contains("f_rest_8") && !header.contains("f_rest_9"), "{header}");
    let missing = bench.refusal(3, &["g.ply", "-o", "r.ply", "--layout", "r3dg"]);
    assert!(missing.contains("have no observations") && missing.contains("decompose"), "{missing}");
    let fainter = bench.export(&["g.ply", "-o", "faint.ply", "--min-opacity", "0.5"]);
    let dropped = fainter["dropped_faint"].as_u64().unwrap();
    assert!(dropped > 0 && fainter["gaussians"].as_u64().unwrap() == 200 - dropped);
    let misplaced = bench.refusal(2, &["g.ply", "-o", "a.spz", "--layout", "inria"]);
    assert!(misplaced.contains("--layout belongs to the format ply"), "{misplaced}");
    let output = bench.run("export", &["g.ply", "-o", "-", "--format", "spz", "-q"]);
    assert!(output.stdout.starts_with(&[0x1f, 0x8b]) && output.status.success());
}

#[test]
fn refusals_are_clear_and_leave_nothing() {
    let bench = Bench::new();
    let unknown = bench.refusal(2, &["g.ply", "-o", "a.obj"]);
    assert!(unknown.contains("names no format: a.obj") && unknown.contains(".compressed.ply"));
    let nothing = bench.refusal(2, &["-o", "a.ply"]);
    assert!(nothing.contains("nothing to export was named"), "{nothing}");
    let unread = bench.refusal(2, &["g.ply", "-o", "a.usda", "--verify"]);
    assert!(unread.contains("--verify reads the product"), "{unread}");

    let mut broken = motes_testkit::random_gaussians(3, 9, 1);
    broken.means[4][1] = f32::NAN;
    broken.rotations[6] = [0.0; 4];
    bench.put("nan.ply", &broken);
    let nan = bench.refusal(3, &["nan.ply", "-o", "a.sog"]);
    assert!(nan.contains("2 of 9 Gaussians") && nan.contains("the first is number 4"), "{nan}");
    assert!(nan.contains("nan.ply") && nan.contains("help: leave them out with --drop-invalid"));
    let report = bench.export(&["nan.ply", "-o", "kept.sog", "--drop-invalid"]);
    assert_eq!((&report["gaussians"], &report["dropped_invalid"]), (&7.into(), &2.into()));

    bench.put("none.ply", &Gaussians::empty(3));
    let none = bench.refusal(3, &["none.ply", "-o", "a.spz"]);
    assert!(none.contains("there are no Gaussians to export: none.ply"), "{none}");

    let mut bytes = fs::read(bench.path("g.ply")).unwrap();
    let at = bytes.windows(11).position(|w| w == b"vertex 200\n").unwrap();
    bytes.splice(at..at + 11, *b"vertex 100000000\n");
    fs::write(bench.path("huge.ply"), bytes).unwrap();
    let huge = bench.refusal(3, &["huge.ply", "-o", "a.spz"]);
    assert!(huge.contains("promises 100000000 rows") && huge.contains("huge.ply"), "{huge}");
    fs::write(bench.path("text.txt"), "hello").unwrap();
    let text = bench.refusal(3, &["text.txt", "-o", "a.spz"]);
    assert!(text.contains("not a known format of Gaussians") && text.contains("sog"), "{text}");
}

#[cfg(target_os = "linux")]
#[test]
fn many_files_go_into_a_folder_and_a_broken_one_loses_no_other() {
    let bench = Bench::new();
    bench.put("h.ply", &motes_testkit::random_gaussians(4, 100, 0));
    let said = bench.export(&["g.ply", "h.ply", "--format", "spz", "-o", "small/"]);
    assert_eq!(said["files"].as_array().unwrap().len(), 2, "{said}");
    for (name, count) in [("small/g.spz", 200), ("small/h.spz", 100)] {
        assert_eq!(open_gaussians(&bench.path(name)).unwrap().gaussians.len(), count, "{name}");
    }
    let again = bench.refusal(2, &["g.ply", "h.ply", "--format", "spz", "-o", "small"]);
    assert!(again.contains("exists already"), "{again}");
    fs::create_dir(bench.path("other")).unwrap();
    fs::write(bench.path("other/g.ply"), "ply").unwrap();
    let twins = bench.refusal(2, &["g.ply", "other/g.ply", "--format", "spz", "-o", "new/"]);
    assert!(twins.contains("would both become new/g.spz"), "{twins}");
    fs::write(bench.path("bad.ply"), "ply").unwrap();
    let line = ["g.ply", "bad.ply", "h.ply", "--format", "sog", "-o", "new/"];
    let output = bench.run("export", &line);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("1 of 3 files were not exported: bad.ply"), "{said}");
    assert!(bench.path("new/g.sog").exists() && bench.path("new/h.sog").exists());
    assert!(!bench.path("new/bad.sog").exists());
}

#[test]
fn a_full_disk_is_an_error_in_every_format() {
    let bench = Bench::new();
    for codec in CODECS.iter().filter(|codec| codec.is_writable()) {
        let line = ["g.ply", "-o", "/dev/full", "--format", codec.name, "--no-provenance"];
        let said = bench.refusal(1, &line);
        assert!(said.contains("No space left on device") && said.contains("/dev/full"), "{said}");
    }
}

#[test]
fn cameras_come_back_through_import() {
    let bench = Bench::new();
    let tiny = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/captures/tiny");
    let imported =
        bench.run("import-colmap", &[tiny.to_str().unwrap(), "-o", "capture", "--test-every", "4"]);
    assert!(imported.status.success(), "{}", String::from_utf8_lossy(&imported.stderr));
    let capture = |file: &str| motes_formats::capture::read_capture(&bench.path(file)).unwrap();
    let before = capture("capture/capture.json");
    let line = |output, more: &[&'static str]| {
        [&["--capture", "capture/capture.json", "-o", output], more].concat()
    };
    bench.export(&line("capture/transforms.json", &[]));
    bench.export(&line("model", &["--format", "colmap"]));
    bench.export(&line("text", &["--format", "colmap-text"]));
    let report = bench.export(&line("cameras.gltf", &[]));
    assert_eq!(report["poses"], before.views.len());
    for (i, source) in [
        &["capture/transforms.json"][..],
        &["--model", "model", "--images", "capture/images"],
        &["--model", "text", "--images", "capture/images"],
    ]
    .into_iter()
    .enumerate()
    {
        let folder = format!("again-{i}");
        let output = bench.run("import-colmap", &[source, &["-o", folder.as_str()]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let again = capture(&format!("{folder}/capture.json"));
        assert_eq!(again.views.len(), before.views.len(), "{source:?}");
        for (a, b) in again.views.iter().zip(&before.views) {
            assert_eq!(a.name.rsplit('/').next(), b.name.rsplit('/').next());
            let (p, q) =
                (again.cameras[a.camera].as_pinhole(), before.cameras[b.camera].as_pinhole());
            let (p, q) = (p.unwrap(), q.unwrap());
            assert!((p.fx - q.fx).abs() < 1e-9 && (p.cy - q.cy).abs() < 1e-9);
            let shift = again.world_origin - before.world_origin;
            let center = a.camera_from_world.center_in_world() + shift;
            assert!(center.distance(b.camera_from_world.center_in_world()) < 1e-6, "{source:?}");
        }
        assert_eq!(again.points.len(), before.points.len(), "{source:?}");
    }
}
