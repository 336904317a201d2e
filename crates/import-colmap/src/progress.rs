//! Who is told how far an import is.

/// Receiver of progress; called from several threads.
pub trait Progress: Sync {
    /// A phase of `total` steps begins.
    fn begin(&self, phase: &str, total: usize);
    /// `done` of the steps of the running phase are finished.
    fn advance_to(&self, done: usize);
    /// Whether the user asked to stop.
    fn interrupted(&self) -> bool;
}

/// Tells nobody and never stops.
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _phase: &str, _total: usize) {}

    fn advance_to(&self, _done: usize) {}

    fn interrupted(&self) -> bool {
        false
    }
}
