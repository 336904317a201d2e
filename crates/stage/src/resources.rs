//! What a run cost: CPU seconds and peak memory of this process and the programs it started.

/// CPU seconds (user + system) of this process and its finished children.
pub(crate) fn cpu_seconds() -> Option<f64> {
    #[cfg(unix)]
    {
        use nix::sys::resource::{UsageWho, getrusage};
        use nix::sys::time::TimeValLike as _;
        let seconds = |who| {
            let usage = getrusage(who).ok()?;
            Some((usage.user_time() + usage.system_time()).num_microseconds() as f64 * 1e-6)
        };
        Some(seconds(UsageWho::RUSAGE_SELF)? + seconds(UsageWho::RUSAGE_CHILDREN)?)
    }
    #[cfg(not(unix))]
    None
}

/// Peak resident memory of this process, bytes.
pub(crate) fn peak_memory_bytes() -> Option<u64> {
    // getrusage counts what the parent held before exec, so Linux's own line comes first.
    high_water_mark().or_else(|| {
        #[cfg(unix)]
        {
            use nix::sys::resource::{UsageWho, getrusage};
            let unit = if cfg!(target_os = "macos") { 1 } else { 1024 };
            let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
            u64::try_from(usage.max_rss()).ok().map(|rss| rss * unit)
        }
        #[cfg(not(unix))]
        None
    })
}

fn high_water_mark() -> Option<u64> {
    parse_high_water_mark(&std::fs::read_to_string("/proc/self/status").ok()?)
}

fn parse_high_water_mark(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_status_line_is_read() {
        assert_eq!(parse_high_water_mark("Name:\tx\nVmHWM:\t   12 kB\n"), Some(12 * 1024));
        assert_eq!(parse_high_water_mark("Name:\tx\n"), None);
    }

    #[cfg(unix)]
    #[test]
    fn work_costs_time_and_memory() {
        let before = cpu_seconds().unwrap();
        let values: Vec<u64> = (0..4_000_000).map(|i| std::hint::black_box(i) * 3).collect();
        assert!(std::hint::black_box(values.iter().sum::<u64>()) > 0);
        assert!(cpu_seconds().unwrap() > before);
        assert!(peak_memory_bytes().unwrap() >= 8 * 4_000_000);
    }
}
