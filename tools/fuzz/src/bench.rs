//! A folder with a scene, a capture and a splat, and programs that run in it.

use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context as _, ensure};
use motes_testkit::toy_capture::{ToyCapture, toy_capture};
use motes_testkit::toy_scene::{ToyScene, toy_scene};

/// Address space of a program, KiB: room for the programs, none for a bomb.
const MOST_KIB: u64 = 3 << 20;
/// Every input here is small: what takes longer hangs.
const MOST_TIME: Duration = Duration::from_secs(60);
/// Bytes of a message that are kept.
const KEPT: u64 = 1 << 20;

/// How a program ended.
pub(crate) struct Ended {
    /// `None` when it did not, in time.
    pub(crate) status: Option<ExitStatus>,
    /// What it said.
    pub(crate) stderr: String,
}

pub(crate) struct Bench {
    /// `scene/`, `capture.json` with its photos, `true.ply`.
    pub(crate) capture: ToyCapture,
    pub(crate) scene: ToyScene,
    pub(crate) seed: u64,
    programs: PathBuf,
    keep: PathBuf,
    runs: usize,
    failures: usize,
}

impl Bench {
    pub(crate) fn new(programs: &Path, keep: &Path, seed: u64) -> anyhow::Result<Self> {
        let programs = std::path::absolute(programs)?;
        let first = programs.join("render");
        ensure!(first.exists(), "no programs here, make build makes them: {}", programs.display());
        let (capture, scene) = (toy_capture(), toy_scene());
        let keep = std::path::absolute(keep)?;
        Ok(Self { capture, scene, seed, programs, keep, runs: 0, failures: 0 })
    }

    /// The folder that programs run in.
    pub(crate) fn folder(&self) -> &Path {
        self.capture.folder.path()
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder().join(name)
    }

    /// An empty folder `run` for products.
    pub(crate) fn clear(&self) -> anyhow::Result<PathBuf> {
        let run = self.path("run");
        if run.exists() {
            std::fs::remove_dir_all(&run).context("the folder of products")?;
        }
        std::fs::create_dir_all(&run)?;
        Ok(run)
    }

    /// Starts a stage under a limit of memory. `{scene}` in an argument is the toy scene.
    pub(crate) fn start(&self, line: &[&str]) -> anyhow::Result<Child> {
        let scene = self.scene.path("scene").display().to_string();
        let mut command = Command::new("sh");
        command
            .args(["-c", &format!("ulimit -v {MOST_KIB}; exec \"$0\" \"$@\"")])
            .arg(self.programs.join(line[0]))
            .args(line[1..].iter().map(|word| word.replace("{scene}", &scene)))
            .current_dir(self.folder())
            .env_remove("MOTES_THREADS")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        command.spawn().with_context(|| format!("cannot start {}", line[0]))
    }

    /// Runs a stage to its end, or as long as is granted.
    pub(crate) fn run(&mut self, line: &[&str]) -> anyhow::Result<Ended> {
        self.runs += 1;
        wait(self.start(line)?, MOST_TIME)
    }

    /// Counts a run that [`Self::start`] started.
    pub(crate) fn count(&mut self) {
        self.runs += 1;
    }

    /// Notes a failure, and keeps the file that caused it.
    pub(crate) fn fail(&mut self, line: &[&str], what: &str, input: Option<&Path>) {
        self.failures += 1;
        say(&format!("FAILED {}: {what}", line.join(" ")));
        let Some(input) = input else { return };
        let name = input.file_name().unwrap_or_default().to_string_lossy();
        let kept = self.keep.join(format!("{}-{}-{name}", self.failures, line[0]));
        let copied = std::fs::create_dir_all(&self.keep).and_then(|()| std::fs::copy(input, &kept));
        if copied.is_ok() {
            say(&format!("  input kept: {}", kept.display()));
        }
    }

    pub(crate) fn finish(&self) -> usize {
        say(&format!("fuzz: {} runs, {} failures, seed {}", self.runs, self.failures, self.seed));
        self.failures
    }
}

/// Waits for a child; kills it when its time is over.
pub(crate) fn wait(mut child: Child, most: Duration) -> anyhow::Result<Ended> {
    let began = Instant::now();
    let stderr = child.stderr.take();
    let listener = std::thread::spawn(move || {
        let mut text = Vec::new();
        if let Some(stderr) = stderr {
            // A child that was killed has said what it had to.
            let _ = stderr.take(KEPT).read_to_end(&mut text);
        }
        String::from_utf8_lossy(&text).into_owned()
    });
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break Some(status);
        }
        if began.elapsed() > most {
            child.kill()?;
            child.wait()?;
            break None;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let stderr = listener.join().unwrap_or_default();
    Ok(Ended { status, stderr })
}

/// To standard error.
pub(crate) fn say(text: &str) {
    // Nobody is left to tell when this fails.
    let _ = writeln!(std::io::stderr(), "{text}");
}
