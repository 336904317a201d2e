//! Running a child process and hearing what it says while it runs.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

use crate::error::{IngestError, Result};
use crate::progress::Progress;

/// How often an interruption is looked for while the child is silent.
const POLL: Duration = Duration::from_millis(100);
/// Lines of the child's talk that are kept for an error message.
const KEPT_LINES: usize = 40;

/// A line and the stream it came from.
pub(in crate::files) enum Line {
    Out(String),
    Err(String),
}

/// How a child ended.
pub(in crate::files) struct Ended {
    pub(in crate::files) status: ExitStatus,
    /// The last lines of standard error.
    pub(in crate::files) last_words: Vec<String>,
}

/// Runs a command to its end, hands every line to `hear`, and kills it when the user asks to
/// stop. Its standard input stays empty and open as long as this process lives.
pub(in crate::files) fn run(
    command: &mut Command,
    progress: &dyn Progress,
    hear: &mut dyn FnMut(&Line),
) -> Result<Ended> {
    let name = command.get_program().to_string_lossy().into_owned();
    let failed = |what: &str, error: std::io::Error| IngestError::Failed {
        cause: format!("{what} {name} ({error})"),
        remedy: "check that the program is there and may be run".into(),
    };
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| failed("cannot start", error))?;
    // Waiting would close it first, and the child would take this for the end of its parent.
    let alive = child.stdin.take();
    let (sender, receiver) = channel();
    let mut readers = Vec::new();
    if let Some(out) = child.stdout.take() {
        readers.push(read_lines(out, sender.clone(), Line::Out));
    }
    if let Some(err) = child.stderr.take() {
        readers.push(read_lines(err, sender.clone(), Line::Err));
    }
    drop(sender);
    let mut last_words = VecDeque::new();
    loop {
        match receiver.recv_timeout(POLL) {
            Ok(line) => {
                if let Line::Err(text) = &line {
                    tracing::debug!("{name}: {text}");
                    last_words.push_back(text.clone());
                    if last_words.len() > KEPT_LINES {
                        last_words.pop_front();
                    }
                }
                hear(&line);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if progress.interrupted() {
            // Both may fail only when the child has just ended by itself.
            let _ = child.kill();
            let _ = child.wait();
            return Err(IngestError::Interrupted);
        }
    }
    for reader in readers {
        let _ = reader.join();
    }
    let status = child.wait().map_err(|error| failed("lost", error))?;
    drop(alive);
    Ok(Ended { status, last_words: last_words.into() })
}

fn read_lines(
    stream: impl Read + Send + 'static,
    sender: Sender<Line>,
    wrap: fn(String) -> Line,
) -> std::thread::JoinHandle<()> {
    std::thread::spawn(move || {
        let mut stream = BufReader::new(stream);
        let mut bytes = Vec::new();
        // Bytes, not text: a program may write a name that is not UTF-8.
        while stream.read_until(b'\n', &mut bytes).is_ok_and(|count| count > 0) {
            let text = String::from_utf8_lossy(&bytes).trim_end().to_string();
            bytes.clear();
            if sender.send(wrap(text)).is_err() {
                return;
            }
        }
    })
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::progress::Silent;

    struct Impatient;

    impl Progress for Impatient {
        fn begin(&self, _phase: &str, _total: usize) {}
        fn advance_to(&self, _done: usize) {}
        fn interrupted(&self) -> bool {
            true
        }
    }

    #[test]
    fn both_streams_and_the_status_arrive() {
        let mut lines = Vec::new();
        let mut command = Command::new("sh");
        command.args(["-c", "echo a; echo b >&2; exit 3"]);
        let ended = run(&mut command, &Silent, &mut |line| {
            if let Line::Out(text) = line {
                lines.push(text.clone());
            }
        })
        .unwrap();
        assert_eq!(ended.status.code(), Some(3));
        assert_eq!((lines, ended.last_words), (vec!["a".to_string()], vec!["b".to_string()]));
    }

    #[test]
    fn an_interrupted_child_is_killed() {
        let started = std::time::Instant::now();
        let mut command = Command::new("sleep");
        let result = run(command.arg("60"), &Impatient, &mut |_| {});
        assert!(matches!(result, Err(IngestError::Interrupted)));
        assert!(started.elapsed().as_secs() < 10);
    }

    #[test]
    fn a_missing_program_is_named() {
        let error = run(&mut Command::new("no-such-program-here"), &Silent, &mut |_| {});
        assert!(error.err().unwrap().to_string().contains("no-such-program-here"));
    }
}
