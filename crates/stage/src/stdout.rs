//! Standard output as a data stream.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// Whether a reader closed the pipe. Kept apart from other broken pipes (a child process that
/// died, say), which are failures.
static CLOSED: AtomicBool = AtomicBool::new(false);

/// The first other failure, which [`Stdout::drop`] could not return to anybody.
static FAILURE: Mutex<Option<String>> = Mutex::new(None);

/// Locked standard output; see [`crate::Context::stdout`].
#[derive(Debug)]
pub struct Stdout(io::BufWriter<io::StdoutLock<'static>>);

impl Stdout {
    pub(crate) fn new() -> Self {
        Self(io::BufWriter::new(io::stdout().lock()))
    }
}

fn note<T>(result: io::Result<T>) -> io::Result<T> {
    if let Err(error) = &result {
        if error.kind() == io::ErrorKind::BrokenPipe {
            CLOSED.store(true, Ordering::SeqCst);
        } else {
            let mut failure = FAILURE.lock().unwrap_or_else(PoisonError::into_inner);
            failure.get_or_insert_with(|| error.to_string());
        }
    }
    result
}

impl Write for Stdout {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        note(self.0.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        note(self.0.flush())?;
        note(io::stdout().flush())
    }
}

impl Drop for Stdout {
    fn drop(&mut self) {
        // `note` keeps the failure for the end of the run.
        let _ = self.flush();
    }
}

/// Writes a whole text to stdout.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut out = Stdout::new();
    out.write_all(text.as_bytes())?;
    out.flush()
}

/// Whether the reader of stdout has gone.
pub(crate) fn reader_is_gone() -> bool {
    CLOSED.load(Ordering::SeqCst)
}

/// Why output was lost, if it was.
pub(crate) fn failure() -> Option<String> {
    FAILURE.lock().unwrap_or_else(PoisonError::into_inner).clone()
}
