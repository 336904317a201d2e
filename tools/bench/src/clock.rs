//! Processor time, so that a busy machine does not show in the numbers.

use std::time::Duration;

use nix::time::{ClockId, clock_gettime};

/// Processor time of all threads of this process.
pub(crate) fn process_time() -> Duration {
    clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).map_or(Duration::ZERO, |t| {
        Duration::new(t.tv_sec().unsigned_abs(), t.tv_nsec().unsigned_abs() as u32)
    })
}

/// Processor nanoseconds of the fastest of many calls.
pub(crate) fn fastest_ns(mut work: impl FnMut()) -> f64 {
    work();
    let mut best = f64::MAX;
    for _ in 0..60 {
        let start = process_time();
        for _ in 0..4 {
            work();
        }
        best = best.min((process_time() - start).as_nanos() as f64 / 4.0);
    }
    best
}
