//! The behavior that every stage inherits, seen from outside through `examples/demo_stage.rs`.
//!
//! Which test goes where: what a user types and sees belongs here; parts belong beside the code;
//! what a certain stage does with its own flags belongs to `crates/<stage>/tests`.

#![expect(clippy::unwrap_used, reason = "a test that cannot start its stage has failed")]

mod interrupt;

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// The example next to this test in the target folder. `cargo test` builds examples first.
fn demo() -> Command {
    let here = std::env::current_exe().unwrap();
    let example = here.parent().unwrap().parent().unwrap().join("examples/demo_stage");
    assert!(example.exists(), "run `cargo test --release -p motes-stage`: it builds {example:?}");
    let mut command = Command::new(example);
    for variable in ["MOTES_THREADS", "MOTES_LOG", "MOTES_INVOKED_AS", "RUST_BACKTRACE"] {
        command.env_remove(variable);
    }
    command
}

struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let bench = Self { dir: tempfile::tempdir().unwrap() };
        std::fs::write(bench.path("a.txt"), "abc").unwrap();
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn run(&self, arguments: &[&str]) -> Output {
        demo().current_dir(self.dir.path()).args(arguments).output().unwrap()
    }

    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.dir.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

#[test]
fn a_run_makes_product_and_record_and_keeps_stdout_empty() {
    let bench = Bench::new();
    let output = bench.run(&["a.txt", "-o", "out/j.txt", "--seed", "7", "-j", "2"]);
    assert_eq!((code(&output), stdout(&output)), (0, ""), "{}", stderr(&output));
    assert!(stderr(&output).contains("1 files, 3 bytes"), "{}", stderr(&output));
    assert_eq!(std::fs::read_to_string(bench.path("out/j.txt")).unwrap(), "abc");

    let record = std::fs::read(bench.path("out/j.txt.run.json")).unwrap();
    let record: Value = serde_json::from_slice(&record).unwrap();
    assert_eq!((&record["format"], &record["version"]), (&"motes/run".into(), &"1.0".into()));
    assert_eq!(record["seed"], 7);
    assert_eq!(record["threads"], 2);
    assert_eq!(record["inputs"][0]["role"], "input");
    assert_eq!(record["report"]["bytes"], 3);
    let hash = record["inputs"][0]["sha256"].as_str().unwrap();
    assert!(hash.starts_with("ba7816bf"), "{hash}");
    assert!(record["argv"].as_array().unwrap().iter().any(|a| a == "--seed"));
}

#[test]
fn no_provenance_means_no_record() {
    let bench = Bench::new();
    assert_eq!(code(&bench.run(&["a.txt", "-o", "j.txt", "--no-provenance"])), 0);
    assert_eq!(bench.files(), ["a.txt", "j.txt"]);
}

#[test]
fn json_puts_one_object_on_stdout() {
    let bench = Bench::new();
    let output = bench.run(&["a.txt", "-o", "j.txt", "--json"]);
    let report: Value = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!(report["files"], 1);
    assert!(!stderr(&output).contains("1 files"), "{}", stderr(&output));
}

#[test]
fn quiet_says_nothing() {
    let bench = Bench::new();
    let output = bench.run(&["a.txt", "-o", "j.txt", "-q"]);
    assert_eq!((stdout(&output), stderr(&output)), ("", ""));
}

#[test]
fn help_and_version_go_to_stdout() {
    let bench = Bench::new();
    let output = bench.run(&["--help"]);
    assert_eq!((code(&output), stderr(&output)), (0, ""));
    for word in ["Join text files", "Usage: demo", "--overwrite", "--generate", "--repeat"] {
        assert!(stdout(&output).contains(word), "no {word:?} in\n{}", stdout(&output));
    }
    assert!(!stdout(&output).contains("--summary"));
    let version = bench.run(&["--version"]);
    assert!(stdout(&version).starts_with("demo-stage 0."), "{}", stdout(&version));
}

#[test]
fn usage_shows_the_dispatcher_only_when_it_called() {
    let usage = |invoked_as: &str| {
        let output = demo().arg("--help").env("MOTES_INVOKED_AS", invoked_as).output().unwrap();
        stdout(&output).lines().find(|l| l.starts_with("Usage:")).unwrap().to_owned()
    };
    assert!(usage("motes demo-stage").starts_with("Usage: motes demo-stage "));
    assert!(!usage("motes other").contains("motes"));
}

#[test]
fn a_wrong_command_line_exits_2_and_writes_nothing() {
    let bench = Bench::new();
    for arguments in [&["a.txt"][..], &["a.txt", "-o", "j", "--nope"], &["a.txt", "-o", "j", "-qv"]]
    {
        let output = bench.run(arguments);
        assert_eq!((code(&output), stdout(&output)), (2, ""));
        assert!(stderr(&output).starts_with("motes demo-stage: "), "{}", stderr(&output));
    }
    assert_eq!(bench.files(), ["a.txt"]);
}

#[test]
fn an_existing_output_stays_unless_overwrite() {
    let bench = Bench::new();
    std::fs::write(bench.path("j.txt"), "mine").unwrap();
    let output = bench.run(&["a.txt", "-o", "j.txt"]);
    assert_eq!(code(&output), 2);
    let expected = "motes demo-stage: output exists already: j.txt\n\
                    help: choose another path or pass --overwrite\n";
    assert_eq!(stderr(&output), expected);
    assert_eq!(std::fs::read_to_string(bench.path("j.txt")).unwrap(), "mine");
    assert_eq!(code(&bench.run(&["a.txt", "-o", "j.txt", "-w"])), 0);
    assert_eq!(std::fs::read_to_string(bench.path("j.txt")).unwrap(), "abc");
}

#[test]
fn bad_input_exits_3() {
    let bench = Bench::new();
    let missing = bench.run(&["none.txt", "-o", "j.txt"]);
    assert_eq!(code(&missing), 3);
    let expected = "motes demo-stage: input: no such file or folder: none.txt\n";
    assert_eq!(stderr(&missing), expected);
    std::fs::write(bench.path("b.txt"), [0xff, 0xfe]).unwrap();
    assert_eq!(code(&bench.run(&["b.txt", "-o", "new/folder/j.txt"])), 3);
    assert_eq!(bench.files(), ["a.txt", "b.txt"]);
}

#[test]
fn a_missed_gate_exits_4_after_the_report() {
    let bench = Bench::new();
    let output = bench.run(&["a.txt", "-o", "j.txt", "--require", "9", "--json"]);
    assert_eq!(code(&output), 4);
    assert!(stdout(&output).contains("\"bytes\":3"), "{}", stdout(&output));
    assert!(stderr(&output).contains("3 bytes is less than the 9 required"));
}

#[test]
fn a_panic_is_one_line_and_exits_1() {
    let bench = Bench::new();
    let output = bench.run(&["a.txt", "-o", "j.txt", "--panic", "--progress", "none"]);
    assert_eq!(code(&output), 1);
    let text = stderr(&output);
    assert!(text.starts_with("motes demo-stage: internal error: the join broke ("), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
}

#[test]
fn a_dry_run_writes_nothing() {
    let bench = Bench::new();
    let output = bench.run(&["a.txt", "-o", "deep/j.txt", "--dry-run"]);
    assert_eq!((code(&output), stdout(&output)), (0, ""));
    assert_eq!(stderr(&output), "motes demo-stage: would write deep/j.txt\n");
    assert_eq!(bench.files(), ["a.txt"]);
    let output = bench.run(&["a.txt", "-o", "j.txt", "--dry-run", "--json"]);
    assert_eq!(stdout(&output), "{\"dry_run\":true,\"outputs\":[\"j.txt\"]}\n");
}

#[test]
fn the_product_can_go_to_stdout() {
    let bench = Bench::new();
    let output = bench.run(&["a.txt", "-o", "-"]);
    assert_eq!((code(&output), stdout(&output)), (0, "abc"));
    assert_eq!(bench.files(), ["a.txt"]);
    assert_eq!(code(&bench.run(&["a.txt", "-o", "-", "--json"])), 2);
}

#[test]
fn a_closed_pipe_is_success() {
    let bench = Bench::new();
    // More than a pipe holds, so that the stage is still writing when the reader leaves.
    let arguments = ["a.txt", "-o", "-", "--repeat", "1000000", "--progress", "none"];
    let mut child = demo()
        .current_dir(bench.dir.path())
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdout.take().unwrap().read_exact(&mut [0; 10]).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!((code(&output), stderr(&output)), (0, ""));

    for arguments in [&["--help"][..], &["a.txt", "-o", "j", "--json", "-q"]] {
        let mut child = demo()
            .current_dir(bench.dir.path())
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!((code(&output), stderr(&output)), (0, ""), "{arguments:?}");
    }
}

#[test]
fn a_full_disk_is_not_success() {
    if !Path::new("/dev/full").exists() {
        eprintln!("skipped: no /dev/full on this system");
        return;
    }
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let bench = Bench::new();
    let mut child = demo()
        .current_dir(bench.dir.path())
        .args(["a.txt", "-o", "-"])
        .stdout(full)
        .spawn()
        .unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1));
}

#[test]
fn a_dumped_config_repeats_the_run() {
    let bench = Bench::new();
    let line = ["a.txt", "a.txt", "-o", "j.txt", "--repeat", "2", "--progress", "none"];
    let dump = bench.run(&[&line[..], &["--dump-config"]].concat());
    std::fs::write(bench.path("c.json"), &dump.stdout).unwrap();
    assert!(!bench.path("j.txt").exists());
    let again = bench.run(&["--config", "c.json", "--dump-config"]);
    assert_eq!(stdout(&again), stdout(&dump));

    assert_eq!(code(&bench.run(&["--config", "c.json"])), 0);
    assert_eq!(std::fs::read_to_string(bench.path("j.txt")).unwrap(), "abcabcabcabc");
    let output = bench.run(&["--config", "c.json", "-w", "--repeat", "1"]);
    assert_eq!((code(&output), stderr(&output)), (0, "2 files, 6 bytes\n"));

    std::fs::write(bench.path("wrong.json"), "{\"repat\": 1}").unwrap();
    let output = bench.run(&["--config", "wrong.json", "a.txt", "-o", "k.txt"]);
    assert_eq!(code(&output), 3);
    assert!(stderr(&output).contains("no option \"repat\": wrong.json\nhelp: "));
}

#[test]
fn manual_and_completions_need_no_input() {
    let bench = Bench::new();
    for (what, word) in
        [("man", ".TH demo-stage"), ("bash", "complete -F"), ("fish", "complete -c")]
    {
        let output = bench.run(&["--generate", what]);
        assert_eq!(code(&output), 0);
        assert!(stdout(&output).contains(word), "{what}: {}", stdout(&output));
    }
    assert_eq!(stdout(&bench.run(&["--generate=zsh"])).lines().next(), Some("#compdef demo-stage"));
    assert_eq!(code(&bench.run(&["--generate", "fortran"])), 2);
    assert_eq!(stdout(&bench.run(&["--summary"])), "Join text files\n");
}

#[test]
fn progress_lines_count_and_json_events_parse() {
    let bench = Bench::new();
    let slow = ["a.txt", "-o", "j.txt", "-w", "--repeat", "3", "--wait", "600"];
    let output = bench.run(&slow);
    let lines: Vec<_> = stderr(&output).lines().filter(|l| l.contains("joining")).collect();
    assert!(lines[0].starts_with("motes demo-stage: joining 2/3 (67 %), "), "{lines:?}");
    assert!(lines.last().unwrap().starts_with("motes demo-stage: joining 3/3 in 1.8 s"));

    std::fs::write(bench.path("a.txt"), "").unwrap();
    let output = bench.run(&[&slow[..], &["--progress", "json"]].concat());
    let events: Vec<Value> =
        stderr(&output).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let kinds: Vec<_> = events.iter().map(|e| e["event"].as_str().unwrap()).collect();
    for kind in ["start", "progress", "joined", "end", "log", "report"] {
        assert!(kinds.contains(&kind), "no {kind} event in {kinds:?}");
    }
    let progress = events.iter().find(|e| e["event"] == "progress").unwrap();
    assert!(progress["eta_s"].as_f64().unwrap() > 0.0 && progress["total"] == 3);
}

#[test]
fn warnings_are_said_and_recorded() {
    let bench = Bench::new();
    std::fs::write(bench.path("a.txt"), "").unwrap();
    let output = bench.run(&["a.txt", "-o", "j.txt", "--log-file", "log.txt"]);
    assert!(stderr(&output).contains("motes demo-stage: warning: all inputs are empty"));
    let record = std::fs::read_to_string(bench.path("j.txt.run.json")).unwrap();
    assert!(record.contains("all inputs are empty"));
    assert!(
        std::fs::read_to_string(bench.path("log.txt")).unwrap().contains("all inputs are empty")
    );
}

#[cfg(unix)]
#[test]
fn more_threads_than_cores_are_not_started() {
    let bench = Bench::new();
    let output = bench.run(&["a.txt", "-o", "j.txt", "--json", "--threads", "100000"]);
    assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_str(stdout(&output)).unwrap();
    let cores = std::thread::available_parallelism().unwrap().get() as u64;
    assert_eq!(report["threads"].as_u64(), Some(cores));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("--threads 100000") && said.contains("warning"), "{said}");
}

#[cfg(unix)]
#[test]
fn a_path_that_no_report_can_name_is_refused_before_work() {
    use std::os::unix::ffi::OsStrExt as _;
    let bench = Bench::new();
    let odd = std::ffi::OsStr::from_bytes(b"j\xff.txt");
    let mut command = demo();
    command.current_dir(bench.dir.path()).args(["a.txt", "-o"]).arg(odd);
    assert_eq!(code(&command.output().unwrap()), 2);
    assert_eq!(bench.files(), ["a.txt"]);
}

#[test]
fn an_output_that_appears_meanwhile_is_not_replaced() {
    let bench = Bench::new();
    let line = ["a.txt", "-o", "j.txt", "--repeat", "20", "--wait", "100", "-q"];
    let child = demo().current_dir(bench.dir.path()).args(line).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(700));
    std::fs::write(bench.path("j.txt"), "theirs").unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(code(&output), 2);
    assert_eq!(std::fs::read_to_string(bench.path("j.txt")).unwrap(), "theirs");
    assert_eq!(bench.files(), ["a.txt", "j.txt"]);
}
