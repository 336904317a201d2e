//! Progress of a long loop, shown as the user chose.

use std::io::IsTerminal as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value, json};

use crate::{ProgressMode, log};

/// Plain lines come at most this often, and less often once a loop runs for minutes, so that the
/// log of a long job stays readable.
const PLAIN_INTERVAL: Duration = Duration::from_secs(1);
/// After this long, a plain line comes every [`LATE_INTERVAL`].
const LATE_AFTER: Duration = Duration::from_secs(60);
const LATE_INTERVAL: Duration = Duration::from_secs(5);
/// JSON events are for programs: often enough to redraw a gauge.
const EVENT_INTERVAL: Duration = Duration::from_millis(200);

/// How progress is shown once the terminal has been looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Display {
    Bar,
    Plain,
    Json,
    Hidden,
}

impl Display {
    pub(crate) fn choose(mode: ProgressMode, quiet: bool) -> Self {
        match mode {
            // A driver that asked for events gets them; --quiet silences what people read.
            ProgressMode::Json => Self::Json,
            _ if quiet => Self::Hidden,
            ProgressMode::Bar => Self::Bar,
            ProgressMode::Plain => Self::Plain,
            ProgressMode::None => Self::Hidden,
            ProgressMode::Auto if std::io::stderr().is_terminal() => Self::Bar,
            ProgressMode::Auto => Self::Plain,
        }
    }
}

/// A running loop. Clones show the same loop; dropping the last one ends it.
#[derive(Clone, Debug)]
pub struct Progress(Arc<Loop>);

#[derive(Debug)]
struct Loop {
    program: String,
    label: String,
    total: u64,
    display: Display,
    bar: ProgressBar,
    started: Instant,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    done: u64,
    /// Steps done before this process: they say nothing about its speed.
    resumed_from: u64,
    message: String,
    last_shown: Option<Instant>,
}

impl Progress {
    pub(crate) fn new(program: &str, label: &str, total: u64, display: Display) -> Self {
        let bar = if display == Display::Bar {
            let bar = log::bars().add(ProgressBar::new(total));
            bar.set_style(style(total));
            bar.set_prefix(label.to_owned());
            bar.enable_steady_tick(PLAIN_INTERVAL);
            bar
        } else {
            ProgressBar::hidden()
        };
        let state = State { done: 0, resumed_from: 0, message: String::new(), last_shown: None };
        let this = Self(Arc::new(Loop {
            program: program.to_owned(),
            label: label.to_owned(),
            total,
            display,
            bar,
            started: Instant::now(),
            state: Mutex::new(state),
        }));
        if display == Display::Json {
            this.0.emit("start", &this.0.lock());
        }
        this
    }

    /// Steps forward.
    pub fn inc(&self, steps: u64) {
        let mut state = self.0.lock();
        state.done += steps;
        self.0.show(&mut state);
    }

    /// Jumps to a number of steps done.
    pub fn set(&self, done: u64) {
        let mut state = self.0.lock();
        state.done = done;
        self.0.show(&mut state);
    }

    /// Starts at a step that an earlier run reached, so that the remaining time is right.
    pub fn resume_from(&self, done: u64) {
        let mut state = self.0.lock();
        state.done = done;
        state.resumed_from = done;
        self.0.bar.set_position(done);
        self.0.bar.reset_eta();
    }

    /// Sets the short text after the numbers, for example the loss.
    pub fn message(&self, text: impl Into<String>) {
        let mut state = self.0.lock();
        state.message = text.into();
        if self.0.display == Display::Bar {
            self.0.bar.set_message(state.message.clone());
        }
    }

    /// Sends named values to the program that drives the stage (`--progress json`); other modes
    /// drop them. Keys of `values` stand beside `event`, `label`, `done` and `total`.
    pub fn event(&self, kind: &str, values: &Value) {
        if self.0.display != Display::Json {
            return;
        }
        let mut object = self.0.head(kind, &self.0.lock());
        if let Value::Object(values) = values {
            object.extend(values.clone());
        }
        log::event(&Value::Object(object));
    }
}

fn style(total: u64) -> ProgressStyle {
    let template = if total == 0 {
        "{prefix} {spinner} {pos} {elapsed} {msg}"
    } else {
        "{prefix} [{bar:28}] {pos}/{len} {percent} % ETA {eta} {msg}"
    };
    ProgressStyle::with_template(template)
        .expect("the template is a constant that the tests draw")
        .progress_chars("=> ")
}

impl Loop {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn show(&self, state: &mut State) {
        let interval = match self.display {
            Display::Hidden => return,
            Display::Bar => return self.bar.set_position(state.done),
            Display::Json => EVENT_INTERVAL,
            Display::Plain if self.started.elapsed() > LATE_AFTER => LATE_INTERVAL,
            Display::Plain => PLAIN_INTERVAL,
        };
        let since = state.last_shown.unwrap_or(self.started);
        if since.elapsed() < interval {
            return;
        }
        state.last_shown = Some(Instant::now());
        if self.display == Display::Json {
            self.emit("progress", state);
        } else {
            log::print(&self.line(state));
        }
    }

    /// Seconds left at the average speed so far.
    fn eta_seconds(&self, state: &State) -> Option<f64> {
        let here = state.done.saturating_sub(state.resumed_from);
        let left = self.total.checked_sub(state.done)?;
        (here > 0).then(|| self.started.elapsed().as_secs_f64() / here as f64 * left as f64)
    }

    fn line(&self, state: &State) -> String {
        let mut line = format!("{}: {} {}", self.program, self.label, state.done);
        if self.total > 0 {
            let percent = 100.0 * state.done as f64 / self.total as f64;
            line.push_str(&format!("/{} ({percent:.0} %)", self.total));
            if let Some(eta) = self.eta_seconds(state) {
                line.push_str(&format!(", {} left", duration_text(eta)));
            }
        }
        if !state.message.is_empty() {
            line.push_str(&format!(", {}", state.message));
        }
        line
    }

    fn head(&self, kind: &str, state: &State) -> Map<String, Value> {
        let Value::Object(object) = json!({
            "event": kind, "label": self.label, "done": state.done, "total": self.total,
            "elapsed_s": round_ms(self.started.elapsed().as_secs_f64()),
        }) else {
            return Map::new();
        };
        object
    }

    fn emit(&self, kind: &str, state: &State) {
        let mut object = self.head(kind, state);
        if let (true, Some(eta)) = (self.total > 0, self.eta_seconds(state)) {
            object.insert("eta_s".into(), round_ms(eta).into());
        }
        if !state.message.is_empty() {
            object.insert("message".into(), state.message.clone().into());
        }
        log::event(&Value::Object(object));
    }
}

impl Drop for Loop {
    fn drop(&mut self) {
        let state = self.lock();
        match self.display {
            Display::Hidden => {}
            Display::Bar => self.bar.abandon(),
            Display::Json => self.emit("end", &state),
            Display::Plain => {
                let took = duration_text(self.started.elapsed().as_secs_f64());
                let total = if self.total > 0 { format!("/{}", self.total) } else { String::new() };
                let (program, label, done) = (&self.program, &self.label, state.done);
                log::print(&format!("{program}: {label} {done}{total} in {took}"));
            }
        }
    }
}

fn round_ms(seconds: f64) -> f64 {
    (seconds * 1e3).round() / 1e3
}

/// `3.2 s`, `2 min 05 s`, `1 h 02 min`.
pub(crate) fn duration_text(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_well() {
        let cases = [(0.04, "0.0 s"), (9.4, "9.4 s"), (59.0, "59 s"), (65.2, "1 min 05 s")];
        for (seconds, text) in cases {
            assert_eq!(duration_text(seconds), text);
        }
        assert_eq!(duration_text(3725.0), "1 h 02 min");
    }

    #[test]
    fn quiet_hides_all_but_events() {
        assert_eq!(Display::choose(ProgressMode::Bar, true), Display::Hidden);
        assert_eq!(Display::choose(ProgressMode::Json, true), Display::Json);
        assert_eq!(Display::choose(ProgressMode::Plain, false), Display::Plain);
    }

    #[test]
    fn the_remaining_time_ignores_resumed_steps() {
        let progress = Progress::new("motes demo", "steps", 1000, Display::Hidden);
        progress.resume_from(900);
        assert_eq!(progress.0.eta_seconds(&progress.0.lock()), None);
        std::thread::sleep(Duration::from_millis(20));
        progress.inc(50);
        let eta = progress.0.eta_seconds(&progress.0.lock()).unwrap();
        let elapsed = progress.0.started.elapsed().as_secs_f64();
        assert!(eta > 0.0 && eta <= elapsed, "{eta} s left after {elapsed} s for half the steps");
    }

    #[test]
    fn a_line_has_count_share_and_message() {
        let progress = Progress::new("motes demo", "fitting", 200, Display::Hidden);
        progress.set(50);
        progress.message("loss 0.1");
        let line = progress.0.line(&progress.0.lock());
        assert!(line.starts_with("motes demo: fitting 50/200 (25 %), "), "{line}");
        assert!(line.ends_with("left, loss 0.1"), "{line}");
    }

    #[test]
    fn both_bar_templates_parse() {
        style(0);
        style(10);
    }
}
