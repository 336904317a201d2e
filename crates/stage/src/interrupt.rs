//! Ctrl-C (and SIGTERM): the first asks, the second kills.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::ExitStatus;

/// Set by the first signal.
static ASKED: AtomicBool = AtomicBool::new(false);
/// Whether the stage has ever looked: one that never does cannot stop in an orderly way.
static LISTENING: AtomicBool = AtomicBool::new(false);

/// Installs the handler, which runs on a thread of its own.
pub(crate) fn install(program: String) {
    let installed = ctrlc::set_handler(move || {
        let first = !ASKED.swap(true, Ordering::SeqCst);
        if first && LISTENING.load(Ordering::SeqCst) {
            let rest = "finishing the current step; press Ctrl-C again to stop at once";
            crate::log::print(&format!("{program}: interrupted: {rest}"));
        } else {
            crate::log::print(&format!("{program}: interrupted"));
            #[expect(clippy::exit, reason = "the work runs on other threads and does not listen")]
            std::process::exit(ExitStatus::Interrupted as i32);
        }
    });
    if let Err(error) = installed {
        tracing::debug!("no interrupt handler ({error}): Ctrl-C ends the process at once");
    }
}

/// Whether the user asked to stop. Calling it promises to stop soon when it says so.
pub(crate) fn asked() -> bool {
    LISTENING.store(true, Ordering::SeqCst);
    ASKED.load(Ordering::SeqCst)
}
