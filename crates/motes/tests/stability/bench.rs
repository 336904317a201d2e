//! Programs in a folder of their own.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

pub(super) const TRAIN: &str = "train-splat";
pub(super) const IMPORT: &str = "import-colmap";
pub(super) const EVALUATE: &str = "evaluate";
pub(super) const RENDER: &str = "render";
pub(super) const REPORT: &str = "report";

pub(super) struct Bench {
    pub(super) folder: tempfile::TempDir,
}

impl Bench {
    pub(super) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// With `cap/capture.json` of the tiny capture and a fit of a few steps, `g.ply`.
    pub(super) fn with_capture() -> Self {
        let bench = Self::new();
        bench.ok(IMPORT, &[tiny().to_str().unwrap(), "-o", "cap", "--test-every", "4", "-q"]);
        bench
    }

    pub(super) fn with_fit() -> Self {
        let bench = Self::with_capture();
        bench.ok(TRAIN, &["--capture", "cap/capture.json", "-o", "g.ply", "-n=5", "-q"]);
        bench
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(super) fn command(&self, program: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(match program {
            "bash" => program,
            stage => motes_testkit::program(stage),
        });
        command.args(arguments).current_dir(self.folder.path()).stdin(Stdio::null());
        command.env_remove("MOTES_THREADS");
        command
    }

    pub(super) fn run(&self, program: &str, arguments: &[&str]) -> Output {
        self.command(program, arguments).output().unwrap()
    }

    /// Under limits of the shell, such as `ulimit -v 1000000`.
    pub(super) fn run_limited(&self, limits: &str, program: &str, arguments: &[&str]) -> Output {
        let script = format!("{limits}; exec \"$0\" \"$@\"");
        let mut all = vec!["-c", &script, motes_testkit::program(program)];
        all.extend(arguments);
        self.run("bash", &all)
    }

    #[track_caller]
    pub(super) fn ok(&self, program: &str, arguments: &[&str]) -> Output {
        let output = self.run(program, arguments);
        assert!(output.status.success(), "{:?}: {}", output.status, text(&output));
        output
    }

    /// Held-out PSNR of a model, dB.
    #[track_caller]
    pub(super) fn psnr(&self, gaussians: &str) -> f64 {
        let line = ["--capture", "cap/capture.json", "--gaussians", gaussians, "--json"];
        let output = self.ok(EVALUATE, &[&line[..], &["--no-provenance"]].concat());
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        report["psnr"].as_f64().unwrap()
    }
}

pub(super) fn tiny() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/captures/tiny")
}

pub(super) fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Failed by itself, with one message and no panic.
#[track_caller]
pub(super) fn clear_error(output: &Output, words: &[&str]) {
    let text = text(output);
    assert!(
        output.status.code().is_some_and(|code| (1..=4).contains(&code)),
        "{:?} {text}",
        output.status
    );
    assert!(!text.contains("panic") && text.starts_with("motes "), "{text}");
    for word in words {
        assert!(text.contains(word), "\"{word}\" in {text}");
    }
}
