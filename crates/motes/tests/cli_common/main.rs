//! What every stage of the suite does alike: help, names of flags, exit codes, what goes to
//! stdout, what is left on disk after a failure.
//!
//! Stages are the crates with a program and a command line. A new one joins with a line in [`line_of`]; what only it does
//! belongs into `cli_<stage>.rs`.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

mod help;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use motes_formats::environment::write_environment;
use motes_formats::ply::{PlyWriteOptions, write_gaussians, write_surface};
use motes_scene::{Gaussians, ImageF32, Materials, Surface};
use serde_json::Value;

/// A complete command line with these inputs, and the product that it would write.
fn line_of(stage: &str) -> (&'static [&'static str], &'static str) {
    match stage {
        "import-colmap" => (&["model", "-o", "out"], "out/capture.json"),
        "train-splat" => (&["--capture", "capture.json", "-o", "out.ply"], "out.ply"),
        "render" => {
            let line = &[
                "--capture",
                "capture.json",
                "--gaussians",
                "g.ply",
                "-o",
                "out/renders",
                "--between",
                "view_01.png",
                "view_02.png",
            ];
            (line, "out/renders")
        }
        "evaluate" => {
            let line =
                &["--capture", "capture.json", "--gaussians", "g.ply", "--metrics", "m.json"];
            (line, "m.json")
        }
        "decompose" => {
            (&["--capture", "capture.json", "--gaussians", "g.ply", "-o", "parts"], "parts")
        }
        "edit" => (&["--gaussians", "g.ply", "--order", "-o", "edited.ply"], "edited.ply"),
        "export" => (&["g.ply", "-o", "out.splat"], "out.splat"),
        "relight" => (&["--scene", "scene", "-o", "baked.ply"], "baked.ply"),
        "segment-select" => {
            (&["--gaussians", "g.ply", "--select", "all", "-o", "picked.json"], "picked.json")
        }
        "estimate-environment" => (&["--scene", "scene", "-o", "light.exr"], "light.exr"),
        "instruct" => (&["clean up", "--gaussians", "g.ply", "-o", "plan.json"], "plan.json"),
        "info" => (&["g.ply", "-o", "info.json"], "info.json"),
        "view" => (&["g.ply", "--no-browser", "-o", "plan.json"], "plan.json"),
        "report lab" => (&["run", "-o", "page.html"], "page.html"),
        "report relight" => {
            let line =
                &["--scene", "s", "--capture", "capture.json", "--own", "own", "-o", "page.html"];
            (line, "page.html")
        }
        "provider check" => {
            (&["no-such-provider", "--kind", "relight", "-o", "found.json"], "found.json")
        }
        new => panic!("{new} needs a line here"),
    }
}

fn stages() -> Vec<String> {
    let crates = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("..")).unwrap();
    let paths = crates.map(|entry| entry.unwrap().path());
    let is_stage =
        |path: &PathBuf| path.join("src/main.rs").exists() && path.join("src/files").exists();
    let mut names: Vec<String> = paths
        .filter(is_stage)
        .map(|path| path.file_name().unwrap().to_str().unwrap().to_owned())
        .filter(|name| !["report", "provider"].contains(&name.as_str()))
        .collect();
    names.extend(["report lab", "report relight", "provider check"].map(str::to_owned));
    names.sort();
    assert!(names.len() >= 3, "{names:?}");
    names
}

/// A folder for one stage, and the way to run it there.
struct Bench {
    dir: tempfile::TempDir,
    stage: String,
}

impl Bench {
    fn of(stage: &str) -> Self {
        Self { dir: tempfile::tempdir().unwrap(), stage: stage.to_owned() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut words = self.stage.split(' ');
        let program = words.next().unwrap();
        let mut command = Command::new(motes_testkit::program(program));
        command.args(words);
        command.current_dir(self.dir.path()).args(arguments).stdin(Stdio::null());
        for variable in ["MOTES_THREADS", "MOTES_LOG", "MOTES_INVOKED_AS", "MOTES_PYTHON"] {
            command.env_remove(variable);
        }
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Every path below the folder.
    fn files(&self) -> Vec<PathBuf> {
        fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    walk(&path, found);
                }
                found.push(path);
            }
        }
        let mut found = Vec::new();
        walk(self.dir.path(), &mut found);
        found.sort();
        found
    }

    fn put(&self, name: &str, bytes: &[u8]) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), bytes).unwrap();
    }

    /// Inputs of the right names that hold nothing sensible.
    fn put_garbage(&self) {
        self.put("capture.json", b"{\"format\": \"motes/capture\", \"version\": \"1.0\", \"cam");
        self.put("g.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\n");
        self.put("run/capture/capture.json", b"[]");
        self.put("run/metrics.json", b"{");
        self.put("scene/decomposition.json", b"{");
        self.put("model/cameras.txt", b"1 PINHOLE many 48 1 1 1 1\n");
        self.put("model/images.txt", b"");
        self.put("model/points3D.txt", b"");
    }

    /// A capture of the tiny model and some Gaussians.
    fn put_inputs(&self) {
        let line = ["-o", self.dir.path().to_str().unwrap(), "-w", "--test-every", "4"];
        let import = Self::of("import-colmap");
        let output = import.run(&[&[tiny().to_str().unwrap()], &line[..]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let gaussians = motes_testkit::random_gaussians(1, 20, 1);
        write_gaussians(&self.path("g.ply"), &gaussians, &PlyWriteOptions::default()).unwrap();
        self.put_scene(gaussians);
    }

    /// The smallest scene folder: Gaussians of one material, no surface, a gray light.
    fn put_scene(&self, mut gaussians: Gaussians) {
        let n = gaussians.len();
        let materials = Materials {
            normals: vec![[0.0, 0.0, 1.0]; n],
            base_color_linear: vec![[0.5; 3]; n],
            roughness: vec![0.5; n],
            metallic: vec![0.0; n],
            visibility: vec![1.0; n],
            observations: vec![1; n],
        };
        materials.attach(&mut gaussians);
        let at = |name: &str| self.path("scene").join(name);
        write_gaussians(&at("gaussians.ply"), &gaussians, &PlyWriteOptions::default()).unwrap();
        write_surface(&at("surface.ply"), &Surface::default()).unwrap();
        let gray = ImageF32::filled(2, 1, 3, 0.5);
        write_environment(&at("environment.exr"), &gray, &[]).unwrap();
        let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/formats");
        let document = corpus.join("decomposition/v1/valid/short.json");
        fs::copy(document, at("decomposition.json")).unwrap();
    }
}

fn tiny() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/captures/tiny")
}

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

#[track_caller]
fn assert_fails(output: &Output, stage: &str, code: i32) {
    let said = stderr(output);
    assert_eq!((output.status.code(), stdout(output)), (Some(code), ""), "{stage}: {said}");
    let voice = format!("motes {stage}: ");
    assert!(said.lines().any(|line| line.starts_with(&voice)), "{stage}: {said}");
    assert!(!said.contains("internal error"), "{stage}: {said}");
}

#[test]
fn a_wrong_command_line_exits_2() {
    for stage in stages() {
        let bench = Bench::of(&stage);
        let (line, _) = line_of(&stage);
        for arguments in [&[][..], &[line, &["--no-such-flag"]].concat()] {
            assert_fails(&bench.run(arguments), &stage, 2);
        }
        assert!(bench.files().is_empty(), "{stage} left {:?}", bench.files());
    }
}

#[test]
fn missing_inputs_exit_3_and_leave_nothing() {
    for stage in stages() {
        let bench = Bench::of(&stage);
        assert_fails(&bench.run(line_of(&stage).0), &stage, 3);
        assert!(bench.files().is_empty(), "{stage} left {:?}", bench.files());
    }
}

#[test]
fn broken_inputs_exit_3_and_leave_nothing() {
    for stage in stages() {
        let bench = Bench::of(&stage);
        bench.put_garbage();
        let before = bench.files();
        assert_fails(&bench.run(line_of(&stage).0), &stage, 3);
        assert_eq!(bench.files(), before, "{stage}");
    }
}

#[test]
fn an_existing_product_is_refused_and_kept() {
    for stage in stages() {
        let bench = Bench::of(&stage);
        bench.put_garbage();
        let (line, product) = line_of(&stage);
        let mine = if stage == "render" { "out/renders/mine.png" } else { product };
        bench.put(mine, b"mine");
        let output = bench.run(line);
        assert_fails(&output, &stage, 2);
        assert!(stderr(&output).contains("help: choose another path or pass --overwrite"));
        assert_eq!(fs::read(bench.path(mine)).unwrap(), b"mine", "{stage}");
    }
}

#[test]
fn a_dumped_config_is_a_fixed_point() {
    for stage in stages() {
        let bench = Bench::of(&stage);
        let (line, _) = line_of(&stage);
        let dump = bench.run(&[line, &["--dump-config"]].concat());
        assert!(dump.status.success(), "{stage}: {}", stderr(&dump));
        let options: Value = serde_json::from_str(stdout(&dump)).unwrap();
        assert!(options.as_object().unwrap().len() > 8, "{stage}: {options}");
        bench.put("config.json", &dump.stdout);
        let again = bench.run(&["--config", "config.json", "--dump-config"]);
        assert_eq!(stdout(&again), stdout(&dump), "{stage}: {}", stderr(&again));
    }
}

#[test]
fn a_dry_run_writes_nothing() {
    // The inputs of the reports are whole runs, which `make lab` and `make relight` cover, that of `provider` is a program.
    let is_on_files = |stage: &String| !stage.starts_with("report") && stage != "provider check";
    for stage in stages().into_iter().filter(is_on_files) {
        let bench = Bench::of(&stage);
        bench.put_inputs();
        let (line, product) = line_of(&stage);
        let tiny = tiny();
        let line = match stage.as_str() {
            "import-colmap" => &[tiny.to_str().unwrap(), "-o", "out"],
            _ => line,
        };
        let before = bench.files();
        let output = bench.run(&[line, &["--dry-run"]].concat());
        let said = stderr(&output);
        assert_eq!((output.status.code(), stdout(&output)), (Some(0), ""), "{stage}: {said}");
        assert!(said.contains(&format!("motes {stage}: would write {product}")), "{said}");
        assert_eq!(bench.files(), before, "{stage}");
    }
}

#[test]
fn stdout_is_the_report_and_only_when_asked() {
    for stage in ["render", "evaluate", "relight"] {
        let bench = Bench::of(stage);
        bench.put_inputs();
        let (line, product) = line_of(stage);
        let output = bench.run(line);
        assert_eq!((output.status.code(), stdout(&output)), (Some(0), ""), "{}", stderr(&output));
        let record = fs::read(bench.path(&format!("{product}.run.json"))).unwrap();
        let record: Value = serde_json::from_slice(&record).unwrap();
        assert_eq!(record["tool"], format!("motes {stage}"));

        let output = bench.run(&[line, &["-w", "--json", "--no-provenance"]].concat());
        let report: Value = serde_json::from_str(stdout(&output)).unwrap();
        assert!(report.is_object(), "{report}");
        let output = bench.run(&[line, &["-w", "-q"]].concat());
        assert_eq!((stdout(&output), stderr(&output)), ("", ""));
    }
}

#[test]
fn a_reader_that_leaves_is_no_failure() {
    for stage in stages() {
        let bench = Bench::of(&stage);
        let mut lines = vec![vec!["--help"]];
        if stage == "evaluate" {
            bench.put_inputs();
            lines.push([line_of(&stage).0, &["--json", "-q"]].concat());
        }
        for line in lines {
            let mut child =
                bench.command(&line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
            drop(child.stdout.take());
            let output = child.wait_with_output().unwrap();
            assert_eq!((output.status.code(), stderr(&output)), (Some(0), ""), "{stage} {line:?}");
        }
    }
}
