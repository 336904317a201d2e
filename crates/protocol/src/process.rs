//! Running a provider to its end, for as long as the user is patient.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;
use std::process::{Child, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use motes_formats::FormatError;
use motes_formats::atomic::ScratchFolder;

use crate::{ProviderCommand, ProviderError};

/// How often an interruption is looked for while a provider works.
pub const POLL: Duration = Duration::from_millis(10);
/// What a program that was asked to end is granted before it is killed.
const GRACE: Duration = Duration::from_secs(2);
/// Bytes of its error output, from the end, that are looked at.
const KEPT_BYTES: u64 = 4096;
/// A provider that says more is ended.
const MOST_SAID_BYTES: u64 = 16 << 20;

/// How long a provider may work, and who can end it earlier.
#[derive(Clone, Copy)]
pub(crate) struct Patience<'a> {
    pub(crate) seconds: f64,
    pub(crate) stopped: &'a dyn Fn() -> bool,
}

/// What a provider was started for: its flag, and the same in words.
pub(crate) type Job = (&'static str, &'static str);

/// How a provider ended.
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    pub(crate) stdout: Vec<u8>,
    /// The end of its error output.
    pub(crate) stderr: String,
}

/// Runs a provider to its end, until it is late or the user asks to stop.
pub(crate) fn run(
    command: &ProviderCommand,
    more: &[&OsStr],
    job: Job,
    patience: Patience<'_>,
) -> Result<Ended, ProviderError> {
    let scratch = ScratchFolder::new().map_err(|e| FormatError::io("temporary folder", e))?;
    let (out, err) = (scratch.path().join("stdout"), scratch.path().join("stderr"));
    let create = |path: &Path| File::create(path).map_err(|e| FormatError::io(path, e));
    let mut started = command.to_command(more);
    started.stdin(Stdio::null()).stdout(create(&out)?).stderr(create(&err)?);
    let mut child = spawn(&mut started, &command.name)?;
    let began = Instant::now();
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |meta| meta.len());
    let status = loop {
        let ended = child.try_wait().map_err(|e| start_error(&command.name, e))?;
        if (patience.stopped)() {
            end_group(&mut child);
            return Err(ProviderError::Stopped);
        }
        if let Some(status) = ended {
            break status;
        }
        if !(began.elapsed().as_secs_f64() <= patience.seconds) {
            end_group(&mut child);
            let (seconds, (flag, what)) = (patience.seconds, job);
            return Err(ProviderError::Late { name: command.name.clone(), seconds, what, flag });
        }
        if size(&out).max(size(&err)) > MOST_SAID_BYTES {
            end_group(&mut child);
            let cause = format!("it says more than {MOST_SAID_BYTES} bytes with --{}", job.0);
            return Err(ProviderError::Protocol { name: command.name.clone(), cause });
        }
        std::thread::sleep(POLL);
    };
    let mut stdout = Vec::new();
    let io = |e| FormatError::io(&out, e);
    File::open(&out).map_err(io)?.take(MOST_SAID_BYTES).read_to_end(&mut stdout).map_err(io)?;
    Ok(Ended { status, stdout, stderr: tail(&err) })
}

pub(crate) fn spawn(
    command: &mut std::process::Command,
    name: &str,
) -> Result<Child, ProviderError> {
    // A group of its own, so that what it starts can be ended with it.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    command.spawn().map_err(|e| start_error(name, e))
}

fn start_error(name: &str, source: std::io::Error) -> ProviderError {
    ProviderError::Start { program: name.to_owned(), source }
}

impl Ended {
    /// The error of a provider that ended with one.
    pub(crate) fn checked(self, name: &str, what: &'static str) -> Result<Self, ProviderError> {
        if self.status.success() {
            return Ok(self);
        }
        let (name, status) = (name.to_owned(), self.status.to_string());
        Err(ProviderError::Failed { name, what, status, said: last_words(&self.stderr) })
    }
}

/// The last line with words, and the remedy when it ends with one.
pub(crate) fn last_words(stderr: &str) -> String {
    let short = |line: &str| line.trim().chars().take(300).collect::<String>();
    let mut lines = stderr.lines().rev().filter(|line| !line.trim().is_empty()).map(short);
    // Usage errors of many programs end with how to get help, and begin with what is wrong.
    if lines.clone().next().is_some_and(|last| last.contains("--help")) {
        return lines.next_back().unwrap_or_default();
    }
    match (lines.next(), lines.next()) {
        (Some(help), Some(text)) if help.starts_with("help:") => format!("{text}\n{help}"),
        (Some(text), _) => text,
        (None, _) => "it said nothing".into(),
    }
}

/// The end of a file as text.
pub(crate) fn tail(path: &Path) -> String {
    let read = || -> std::io::Result<Vec<u8>> {
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(KEPT_BYTES)))?;
        let mut bytes = Vec::new();
        file.take(KEPT_BYTES).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    String::from_utf8_lossy(&read().unwrap_or_default()).into_owned()
}

/// Ends a child that leads a process group, and what it started: asks, waits a little, kills.
pub fn end_group(child: &mut Child) {
    #[cfg(unix)]
    if let Ok(group) = i32::try_from(child.id()) {
        use nix::sys::signal::{Signal, killpg};
        let group = nix::unistd::Pid::from_raw(group);
        let gone = |child: &mut Child| child.try_wait().is_ok_and(|status| status.is_some());
        let _ = killpg(group, Signal::SIGTERM);
        let asked = Instant::now();
        while asked.elapsed() < GRACE && !gone(child) {
            std::thread::sleep(POLL);
        }
        let _ = killpg(group, Signal::SIGKILL);
    }
    // Both fail only when it has ended by itself.
    let _ = child.kill();
    let _ = child.wait();
}
