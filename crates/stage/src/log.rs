//! Everything a stage says on stderr: messages, log lines, events.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock};

use indicatif::{MultiProgress, ProgressDrawTarget};
use serde_json::{Value, json};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields, MakeWriter};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{EnvFilter, Layer as _};

use crate::{CommonArgs, StageError};

/// Environment variable with a `tracing` filter, for example `train_splat=debug,warn`.
const FILTER_VARIABLE: &str = "MOTES_LOG";

/// Bars live here, so that a message can step around them.
static BARS: OnceLock<MultiProgress> = OnceLock::new();
/// Whether stderr carries JSON events instead of text.
static EVENTS: AtomicBool = AtomicBool::new(false);

pub(crate) fn bars() -> &'static MultiProgress {
    BARS.get_or_init(|| MultiProgress::with_draw_target(ProgressDrawTarget::stderr()))
}

pub(crate) fn emit_events(on: bool) {
    EVENTS.store(on, Ordering::SeqCst);
}

fn write_line(text: &str) {
    bars().suspend(|| {
        let mut err = io::stderr().lock();
        // A closed stderr must not stop the work.
        let _ = writeln!(err, "{text}");
    });
}

/// Says a line that every mode shows: errors, the interrupt, a panic.
pub(crate) fn print(text: &str) {
    if EVENTS.load(Ordering::SeqCst) {
        event(&json!({ "event": "message", "message": text }));
    } else {
        write_line(text);
    }
}

/// Writes one event on one line; the caller knows that events are wanted.
pub(crate) fn event(value: &Value) {
    write_line(&value.to_string());
}

/// Starts the logger. Later calls in the same process change nothing.
pub(crate) fn install(common: &CommonArgs, program: &str) -> Result<(), StageError> {
    let default = match (common.quiet, common.verbose) {
        (true, _) => "error",
        (false, 0) => "info",
        (false, 1) => "debug",
        (false, _) => "trace",
    };
    let filter = match std::env::var(FILTER_VARIABLE) {
        Ok(directives) => EnvFilter::try_new(&directives).map_err(|e| {
            StageError::usage(format!("{FILTER_VARIABLE} is not a filter ({e}): {directives}"))
        })?,
        Err(_) => EnvFilter::new(default),
    };
    let terminal = tracing_subscriber::fmt::layer()
        .event_format(Lines { program: program.to_owned() })
        .with_writer(Stderr)
        .with_filter(filter);
    let file = match &common.log_file {
        Some(path) => {
            let file = OpenOptions::new().create(true).append(true).open(path).map_err(|e| {
                StageError::usage(format!("cannot open the log file ({e}): {}", path.display()))
            })?;
            let layer = tracing_subscriber::fmt::layer()
                .with_ansi(false)
                .with_writer(Mutex::new(file))
                .with_filter(EnvFilter::new(if common.verbose > 1 { "trace" } else { "debug" }));
            Some(layer)
        }
        None => None,
    };
    let _ = tracing_subscriber::registry().with(terminal).with(file).try_init();
    Ok(())
}

/// `motes STAGE: warning: text key=value`, or the same as a JSON event.
struct Lines {
    program: String,
}

impl<S, N> FormatEvent<S, N> for Lines
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> std::fmt::Result {
        let mut text = String::new();
        context.format_fields(Writer::new(&mut text), event)?;
        let level = *event.metadata().level();
        if EVENTS.load(Ordering::SeqCst) {
            let level = level.as_str().to_ascii_lowercase();
            return writeln!(
                writer,
                "{}",
                json!({ "event": "log", "level": level, "message": text })
            );
        }
        let label = match level {
            Level::ERROR => "error: ",
            Level::WARN => "warning: ",
            Level::INFO => "",
            Level::DEBUG => "debug: ",
            Level::TRACE => "trace: ",
        };
        writeln!(writer, "{}: {label}{text}", self.program)
    }
}

/// Unbuffered stderr that steps around progress bars.
struct Stderr;

impl Write for Stderr {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        bars().suspend(|| io::stderr().lock().write_all(bytes))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<'a> MakeWriter<'a> for Stderr {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        Self
    }
}
