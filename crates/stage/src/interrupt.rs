//! Ctrl-C (and SIGTERM): the first asks, the second kills. What comes within a second is one wish: `timeout` signals the
//! process and its group, and shells and service managers do likewise.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::ExitStatus;

/// Set by the first signal.
static ASKED: AtomicBool = AtomicBool::new(false);
/// Whether the stage has ever looked: one that never does cannot stop in an orderly way.
static LISTENING: AtomicBool = AtomicBool::new(false);

/// Signals so close together are one.
const ONE_WISH: Duration = Duration::from_secs(1);

/// Installs the handler, which runs on a thread of its own.
pub(crate) fn install(program: String) {
    let mut asked_at = None::<Instant>;
    let installed = ctrlc::set_handler(move || {
        let first = !ASKED.swap(true, Ordering::SeqCst);
        let is_repeat = asked_at.is_some_and(|at| at.elapsed() < ONE_WISH);
        asked_at.get_or_insert_with(Instant::now);
        if is_repeat {
            return;
        }
        if first && LISTENING.load(Ordering::SeqCst) {
            let rest = "finishing the current step; press Ctrl-C again to stop at once";
            crate::log::print(&format!("{program}: interrupted: {rest}"));
        } else {
            crate::log::print(&format!("{program}: interrupted"));
            motes_formats::atomic::remove_unfinished();
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
