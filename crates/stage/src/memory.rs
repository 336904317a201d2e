//! How much memory a stage may still take, so that it can say so before it starts instead of being
//! killed after an hour.

use crate::{Context, StageError};

impl Context {
    /// Checks that about `bytes` more can be had.
    ///
    /// # Errors
    /// [`StageError::BadInput`] with `remedy` when they exceed what the machine, the control group
    /// or a limit of the shell (`ulimit -v`) leaves.
    pub fn need_memory(&self, bytes: u64, remedy: &str) -> Result<(), StageError> {
        match available_bytes() {
            Some(available) if bytes > available => {
                let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
                let text = format!(
                    "this needs about {:.2} GiB of memory, and {:.2} GiB are available",
                    gib(bytes),
                    gib(available)
                );
                Err(StageError::bad_input(text).help(remedy))
            }
            _ => Ok(()),
        }
    }
}

/// The least of what the system, the control group and the address space leave; `None` where the
/// system does not tell.
fn available_bytes() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let free = read("/proc/meminfo").and_then(|text| kib_after(&text, "MemAvailable:"));
    let group = || {
        let number = |path: &str| read(path)?.trim().parse::<u64>().ok();
        let limit = number("/sys/fs/cgroup/memory.max")?;
        Some(limit.saturating_sub(number("/sys/fs/cgroup/memory.current")?))
    };
    let address_space = || {
        let used = kib_after(&read("/proc/self/status")?, "VmSize:")?;
        Some(address_space_limit()?.saturating_sub(used))
    };
    [free, group(), address_space()].into_iter().flatten().min()
}

fn address_space_limit() -> Option<u64> {
    #[cfg(target_os = "linux")]
    {
        use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
        let (soft, _) = getrlimit(Resource::RLIMIT_AS).ok()?;
        (soft != RLIM_INFINITY).then_some(soft)
    }
    #[cfg(not(target_os = "linux"))]
    None
}

fn kib_after(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_any_machine_has_is_refused_with_the_remedy() {
        let context = Context::quiet("test");
        assert!(context.need_memory(1, "buy less").is_ok());
        if available_bytes().is_some() {
            let error = context.need_memory(u64::MAX / 2, "take fewer").unwrap_err();
            assert!(error.to_string().contains("help: take fewer"), "{error}");
        }
    }

    #[test]
    fn lines_of_proc_are_read() {
        assert_eq!(kib_after("A: 1 kB\nVmSize:\t  20 kB\n", "VmSize:"), Some(20 * 1024));
        assert_eq!(kib_after("VmSize: many\n", "VmSize:"), None);
    }
}
