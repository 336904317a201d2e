//! A panic is a bug: one line that asks for a report, exit code 1.

use std::sync::atomic::{AtomicBool, Ordering};

static REPORTED: AtomicBool = AtomicBool::new(false);

/// Replaces the default hook. Only the first panic speaks: when several workers meet the same
/// bug, one line says it all. `RUST_BACKTRACE=1` adds the backtrace.
pub(crate) fn install(program: String) {
    std::panic::set_hook(Box::new(move |info| {
        if REPORTED.swap(true, Ordering::SeqCst) {
            return;
        }
        let payload = info.payload();
        let what = payload
            .downcast_ref::<&str>()
            .copied()
            .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
            .unwrap_or("panic");
        let what = what.lines().collect::<Vec<_>>().join(" ");
        let place =
            info.location().map(|l| format!(" ({}:{})", l.file(), l.line())).unwrap_or_default();
        crate::log::print(&format!("{program}: internal error: {what}{place}; please report it"));
        let backtrace = std::backtrace::Backtrace::capture();
        if backtrace.status() == std::backtrace::BacktraceStatus::Captured {
            crate::log::print(&backtrace.to_string());
        }
    }));
}
