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
        match self.common.max_memory.into_iter().chain(available_bytes()).min() {
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

impl Context {
    /// Checks that the largest of `sizes` (columns, rows) can be drawn with `bytes_per_pixel`: planes, pictures, what the
    /// renderer keeps.
    ///
    /// # Errors
    /// As [`Self::need_memory`], with the size in the words.
    pub fn need_memory_for_pictures(
        &self,
        sizes: impl IntoIterator<Item = (usize, usize)>,
        bytes_per_pixel: u64,
    ) -> Result<(), StageError> {
        let area = |(width, height): (usize, usize)| (width as u64).saturating_mul(height as u64);
        let Some((width, height)) = sizes.into_iter().max_by_key(|size| area(*size)) else {
            return Ok(());
        };
        let bytes = area((width, height)).saturating_mul(bytes_per_pixel);
        let remedy = format!(
            "the largest picture has {width} x {height} pixels: take cameras of fewer, or a smaller --width"
        );
        self.need_memory(bytes, &remedy)
    }
}

/// Bytes of a size such as `8GiB`, `500M` or `1048576`; units are powers of 1024.
pub(crate) fn parse_size(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let unit = unit.trim().to_ascii_lowercase();
    let shift = match unit.trim_end_matches('b').trim_end_matches('i') {
        "" => 0,
        "k" => 10,
        "m" => 20,
        "g" => 30,
        "t" => 40,
        _ => return Err(format!("\"{text}\" has no unit B, KiB, MiB, GiB or TiB")),
    };
    let number: f64 = number.parse().map_err(|_| format!("\"{text}\" is not a size"))?;
    let bytes = number * (1u64 << shift) as f64;
    if bytes >= 1.0 { Ok(bytes as u64) } else { Err("no memory is too little".into()) }
}

/// The least of what the system, the control group and the address space leave; `None` where the
/// system does not tell.
pub(crate) fn available_bytes() -> Option<u64> {
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
    fn what_the_user_allows_is_the_limit() {
        let mut context = Context::quiet("test");
        context.common.max_memory = Some(1 << 20);
        assert!(context.need_memory(1 << 20, "take fewer").is_ok());
        assert!(context.need_memory(1 << 21, "take fewer").is_err());
    }

    #[test]
    fn the_largest_picture_counts() {
        let context = Context::quiet("test");
        assert!(context.need_memory_for_pictures([(640, 480), (1, 1)], 300).is_ok());
        if available_bytes().is_some() {
            let sizes = [(640, 480), (1 << 24, 1 << 24)];
            let error = context.need_memory_for_pictures(sizes, 300).unwrap_err().to_string();
            assert!(error.contains("16777216 x 16777216"), "{error}");
        }
    }

    #[test]
    fn sizes_have_units() {
        for (text, bytes) in
            [("8GiB", 8 << 30), ("1.5k", 1536), ("500 MB", 500 << 20), ("7", 7), ("2t", 2 << 40)]
        {
            assert_eq!(parse_size(text), Ok(bytes), "{text}");
        }
        for text in ["", "GiB", "-1", "5 parsecs", "0", "1e3", "nan"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn lines_of_proc_are_read() {
        assert_eq!(kib_after("A: 1 kB\nVmSize:\t  20 kB\n", "VmSize:"), Some(20 * 1024));
        assert_eq!(kib_after("VmSize: many\n", "VmSize:"), None);
    }
}
