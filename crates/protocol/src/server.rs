//! A provider that stays: `--serve`, one JSON object a line.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use motes_formats::FormatError;
use motes_formats::atomic::ScratchFolder;
use motes_formats::error::quoted;
use serde::{Deserialize, Serialize};

use crate::process::{POLL, Patience, end_group, last_words, spawn, tail};
use crate::{ProviderCommand, ProviderError};

/// A longer line is none of the protocol.
const MOST_LINE_BYTES: u64 = 1 << 20;
/// What a provider is granted to end when its input ends.
const FAREWELL: Duration = Duration::from_secs(2);

/// What a serving provider reads, a line each.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServeRequest {
    /// Path of a `request.json`.
    pub request: PathBuf,
}

/// What a serving provider writes, a line each.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ServeReply {
    /// It did it.
    Done {
        /// Path of the `reply.json`.
        reply: PathBuf,
    },
    /// It could not, and waits for the next request.
    Failed {
        /// Why, in one line.
        error: String,
        /// The remedy.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        help: Option<String>,
        /// The exit code that `--request` would have had.
        exit_code: u8,
    },
}

/// A running provider.
pub(crate) struct Server {
    name: String,
    child: Child,
    /// Dropped first, so that the provider sees the end of its input.
    input: Option<ChildStdin>,
    lines: Receiver<String>,
    scratch: ScratchFolder,
}

impl Server {
    pub(crate) fn start(command: &ProviderCommand) -> Result<Self, ProviderError> {
        let scratch = ScratchFolder::new().map_err(|e| FormatError::io("temporary folder", e))?;
        let err = scratch.path().join("stderr");
        let stderr = File::create(&err).map_err(|e| FormatError::io(&err, e))?;
        let mut started = command.to_command(&[OsStr::new("--serve")]);
        started.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(stderr);
        let mut child = spawn(&mut started, &command.name)?;
        let (sender, lines) = channel();
        if let Some(out) = child.stdout.take() {
            std::thread::spawn(move || {
                let mut out = BufReader::new(out);
                let mut bytes = Vec::new();
                let mut next = |bytes: &mut Vec<u8>| {
                    bytes.clear();
                    out.by_ref().take(MOST_LINE_BYTES).read_until(b'\n', bytes)
                };
                while next(&mut bytes).is_ok_and(|count| count > 0) {
                    let line = String::from_utf8_lossy(&bytes).trim().to_owned();
                    if !line.is_empty() && sender.send(line).is_err() {
                        return;
                    }
                }
            });
        }
        let input = child.stdin.take();
        Ok(Self { name: command.name.clone(), child, input, lines, scratch })
    }

    /// The path of the reply to the request at `path`.
    pub(crate) fn ask(
        &mut self,
        path: &Path,
        patience: Patience<'_>,
    ) -> Result<PathBuf, ProviderError> {
        if let Ok(early) = self.lines.try_recv() {
            return Err(self.protocol(format!("it says {} without a request", quoted(&early))));
        }
        let request = ServeRequest { request: path.to_owned() };
        let mut line = serde_json::to_string(&request).unwrap_or_default();
        line.push('\n');
        let written = self
            .input
            .as_mut()
            .map(|input| input.write_all(line.as_bytes()).and_then(|()| input.flush()));
        if !matches!(written, Some(Ok(()))) {
            return Err(self.gone());
        }
        let line = self.next_line(patience)?;
        match serde_json::from_str(&line) {
            Ok(ServeReply::Done { reply }) => Ok(reply),
            Ok(ServeReply::Failed { error, help, exit_code }) => {
                let said = help.map_or(error.clone(), |help| format!("{error}\nhelp: {help}"));
                let (name, status) = (self.name.clone(), format!("code {exit_code}"));
                Err(ProviderError::Failed { name, what: "a request", status, said })
            }
            Err(_) => {
                let said = quoted(&line);
                Err(self.protocol(format!("it says {said} where one JSON object is due")))
            }
        }
    }

    fn next_line(&mut self, patience: Patience<'_>) -> Result<String, ProviderError> {
        let began = Instant::now();
        loop {
            match self.lines.recv_timeout(POLL) {
                Ok(line) => return Ok(line),
                Err(RecvTimeoutError::Disconnected) => return Err(self.gone()),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if (patience.stopped)() {
                self.end();
                return Err(ProviderError::Stopped);
            }
            if !(began.elapsed().as_secs_f64() <= patience.seconds) {
                self.end();
                let (name, seconds) = (self.name.clone(), patience.seconds);
                return Err(ProviderError::Late {
                    name,
                    seconds,
                    what: "a request",
                    flag: "serve",
                });
            }
        }
    }

    fn protocol(&self, cause: String) -> ProviderError {
        ProviderError::Protocol { name: self.name.clone(), cause }
    }

    /// The error of a provider that left.
    fn gone(&mut self) -> ProviderError {
        self.input = None;
        let status = self.wait(FAREWELL).map_or("still running".into(), |s| s.to_string());
        let said = last_words(&tail(&self.scratch.path().join("stderr")));
        ProviderError::Failed { name: self.name.clone(), what: "--serve", status, said }
    }

    /// Waits for the end of the program, which nobody asks for here.
    pub(crate) fn wait(&mut self, most: Duration) -> Option<std::process::ExitStatus> {
        let began = Instant::now();
        loop {
            match self.child.try_wait() {
                Ok(Some(status)) => return Some(status),
                Ok(None) if began.elapsed() < most => std::thread::sleep(POLL),
                _ => return None,
            }
        }
    }

    /// Closes its input, which is its sign to end.
    pub(crate) fn close(&mut self) {
        self.input = None;
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    pub(crate) fn end(&mut self) {
        end_group(&mut self.child);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.close();
        if self.wait(FAREWELL).is_none() {
            self.end();
        }
    }
}
