//! Places that were free when the user named them: what appears there meanwhile is somebody else's.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

#[derive(Default)]
struct Claims {
    /// Claimed: nothing there is replaced that this process did not make.
    free: HashSet<PathBuf>,
    /// Made by this process: a checkpoint replaces the one before.
    made: HashSet<PathBuf>,
}

static CLAIMS: LazyLock<Mutex<Claims>> = LazyLock::new(Mutex::default);

fn lock() -> MutexGuard<'static, Claims> {
    CLAIMS.lock().unwrap_or_else(PoisonError::into_inner)
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Notes that nothing is at `path` and the user did not allow to replace anything: from here on, writers of this
/// process replace what is there, or below it, only when they made it. Two programs that claim the same place at once
/// cannot both succeed.
pub fn claim_free(path: &Path) {
    lock().free.insert(absolute(path));
}

/// Whether what is at `path` must not be replaced.
pub(super) fn must_stay_free(path: &Path) -> bool {
    let (path, claims) = (absolute(path), lock());
    path.ancestors().any(|place| claims.free.contains(place))
        && !path.ancestors().any(|place| claims.made.contains(place))
}

/// Notes that this process made what is at `path`.
pub(super) fn made(path: &Path) {
    let (path, mut claims) = (absolute(path), lock());
    // Only where it matters: a run may write a hundred thousand pictures.
    if path.ancestors().any(|place| claims.free.contains(place)) {
        claims.made.insert(path);
    }
}
