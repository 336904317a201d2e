//! CPU time of this process, for what the report says about the cost of probes; decides nothing.

/// CPU seconds of all threads so far; 0 where the system does not tell.
pub(crate) fn cpu_seconds() -> f64 {
    #[cfg(unix)]
    {
        use nix::time::{ClockId, clock_gettime};
        clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID)
            .map_or(0.0, |t| t.tv_sec() as f64 + 1e-9 * t.tv_nsec() as f64)
    }
    #[cfg(not(unix))]
    0.0
}
